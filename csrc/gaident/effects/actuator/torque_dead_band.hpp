// Small torques do nothing: 0 for abs(u) <= width, else u - width sign(u) = u - clip(u, -width, width).
#pragma once

#include "../../numeric/elementary.hpp"
#include "../effect.hpp"

namespace gaident {

struct TorqueDeadBand {
    static constexpr EffectInfo info{"torque_dead_band",
                                     Place::actuator,
                                     "torques below this (half) width do nothing, larger ones lose it",
                                     {{"width", "N m", 0.0, 0.0}}};

    template <class R>
    [[gnu::always_inline]] static R step(R width, R u) {
        return u - clamp(u, -width, width);
    }
};

}  // namespace gaident
