// A velocity that comes in steps: round(w/step) step.
#pragma once

#include "../../numeric/elementary.hpp"
#include "../effect.hpp"

namespace gaident {

struct VelocityQuantisation {
    static constexpr EffectInfo info{
        "velocity_quantisation", Place::sensor, "the measured velocity comes in steps (noise)", {{"step", "rad/s", 0.0, 0.0}}};

    template <class R>
    [[gnu::always_inline]] static R seen(R step, R w) {
        return nearest(w / step) * step;
    }
};

}  // namespace gaident
