// A coupling that stiffens with its twist x: torque K x + k3 x^3, x less half the gap where there is backlash too.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct HardeningStiffness {
    static constexpr EffectInfo info{.name = "hardening_stiffness",
                                     .place = Place::coupling,
                                     .meaning = "coupling that grows stiffer with its twist",
                                     .parameter = {{"cubic_stiffness", "N m/rad^3", 0.0, 0.0}},
                                     .needs_two_masses = true};

    template <class R>
    [[gnu::always_inline]] static R correction(R k3, R x) {
        return ((k3 * x) * x) * x;
    }
};

}  // namespace gaident
