// The measured velocity's filter 1/(1 + s tau), exact for a velocity that is linear over the substep, x = h/tau:
//
//     y+ = e^-x y + (1 - e^-x - c) w + c w+,   c = 1 - (1 - e^-x)/x
#pragma once

#include "../effect.hpp"

namespace gaident {

struct VelocityFilter {
    static constexpr EffectInfo info{
        "velocity_filter", Place::sensor, "the measured velocity is filtered, first order", {{"time_constant", "s", 0.0, 0.0}}};

    template <class R>
    [[gnu::always_inline]] static R step(R decay, R old_share, R new_share, R w, R w_next, R y) {
        return (decay * y + old_share * w) + new_share * w_next;
    }
};

}  // namespace gaident
