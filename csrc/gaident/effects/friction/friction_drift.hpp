// Dry friction that changes as the drive warms up: -Tc (1 + rate t) sign(w), t from the record's start; never below zero.
#pragma once

#include "../../numeric/elementary.hpp"
#include "../effect.hpp"

namespace gaident {

struct FrictionDrift {
    static constexpr EffectInfo info{"friction_drift",
                                     Place::shaft,
                                     "dry friction that grows or falls with time",
                                     {{"torque", "N m", 0.0, 0.0}, {"rate", "1/s"}}};

    template <class R>
    [[gnu::always_inline]] static R level(R Tc, R rate, R t) {
        return maximum(Tc * (R(1.0) + rate * t), R(0.0));
    }
};

}  // namespace gaident
