// Play in the coupling: no torque while abs(twist) < gap/2, then stiffness on the rest. As a correction to the linear coupling torque
// K x + D dx/dt:
//
//     -K clamp(x, -gap/2, gap/2),   and inside the gap -D dx/dt as well
#pragma once

#include "../elementary.hpp"
#include "effect.hpp"

namespace gaident {

struct Backlash {
    static constexpr EffectInfo info{.name = "backlash",
                                     .place = Place::coupling,
                                     .meaning = "play between motor and load; gap is its full width",
                                     .parameter = {{"gap", "rad", 0.0, 0.0}},
                                     .needs_two_masses = true};

    template <class R>
    [[gnu::always_inline]] static R correction(R half_gap, R K, R D, R x, R dx) {
        const R damping = greater(half_gap, absolute(x), D * dx, R(0.0));
        return -(K * clamp(x, -half_gap, half_gap) + damping);
    }
};

}  // namespace gaident
