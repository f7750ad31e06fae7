// Samples that are no measurement; found and masked by the diagnosis, not simulated.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct Outliers {
    static constexpr EffectParameter parameters[] = {{"fraction", "1", 0.0, 0.0, 1.0}};
    static constexpr EffectInfo info{
        .name = "outliers",
        .place = Place::record,
        .meaning = "isolated wrong samples (noise)",
        .parameters = parameters,
        .simulated = false,
        .remark = "found and masked, not simulated",
    };
    static constexpr Hooks hooks = Hooks::none;
    static constexpr Pace pace = Pace::sample;
};

}  // namespace gaident
