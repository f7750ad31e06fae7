// Torque ripple tied to the angle: -A sin(n theta + phase).
#pragma once

#include "../../numeric/elementary.hpp"
#include "../effect.hpp"

namespace gaident {

struct Cogging {
    static constexpr EffectInfo info{"cogging",
                                     Place::shaft,
                                     "torque ripple n times per turn: slots and magnets, belts, gears",
                                     {{"amplitude", "N m", 0.0, 0.0}, {"order", "1/turn", any_value, 2.0}, {"phase", "rad"}}};

    template <class R>
    [[gnu::always_inline]] static R torque(R A, R n, R phase, R theta) {
        return A * sine(n * theta + phase);
    }
};

}  // namespace gaident
