// Gravity on an eccentric load: -A sin(theta + phase).
#pragma once

#include "../../numeric/elementary.hpp"
#include "../effect.hpp"

namespace gaident {

struct Unbalance {
    static constexpr EffectInfo info{"unbalance",
                                     Place::shaft,
                                     "load once per turn: gravity on an eccentric load",
                                     {{"amplitude", "N m", 0.0, 0.0}, {"phase", "rad"}}};

    template <class R>
    [[gnu::always_inline]] static R torque(R A, R phase, R theta) {
        return A * sine(theta + phase);
    }
};

}  // namespace gaident
