// The current loop's lag 1/(1 + s tau), exact for a torque v held over the substep h, x = h/tau:
//
//     T+ = v + (T - v) e^-x,   mean of T over the substep = v + (T - v) (1 - e^-x)/x
#pragma once

#include "../effect.hpp"

namespace gaident {

struct TorqueLag {
    static constexpr EffectInfo info{"torque_lag",
                                     Place::actuator,
                                     "the torque follows its command with a first-order lag",
                                     {{"time_constant", "s", 0.0, 0.0}}};

    // Returns the mean; `decay` = e^-x, `mean` = (1 - e^-x)/x.
    template <class R>
    [[gnu::always_inline]] static R step(R decay, R mean, R v, R& T) {
        const R gap = T - v;
        T = v + gap * decay;
        return v + gap * mean;
    }
};

}  // namespace gaident
