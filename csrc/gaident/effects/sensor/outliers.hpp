// Samples that are no measurement; found and masked by the diagnosis, not simulated.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct Outliers {
    static constexpr EffectInfo info{.name = "outliers",
                                     .place = Place::record,
                                     .meaning = "isolated wrong samples (noise); found and masked, not simulated",
                                     .parameter = {{"fraction", "1", 0.0, 0.0, 1.0}},
                                     .simulated = false};
};

}  // namespace gaident
