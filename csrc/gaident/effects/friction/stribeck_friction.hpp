// Dry friction that falls from its static level as motion begins: -(Tc + (Ts - Tc) exp(-(w/vs)^2)) sign(w).
#pragma once

#include "../../numeric/elementary.hpp"
#include "../effect.hpp"

namespace gaident {

struct StribeckFriction {
    static constexpr EffectInfo info{
        .name = "stribeck_friction",
        .place = Place::shaft,
        .meaning = "dry friction, larger at standstill and falling as motion begins",
        .parameter = {{"torque", "N m", 0.0, 0.0},
                      {"static_torque", "N m", 0.0, 0.0},
                      {"stribeck_velocity", "rad/s", any_value, 0.0, infinite, true}},
        .allowed = [](const double* p) { return p[1] >= p[0]; },
        .relation = "static_torque must be at least torque",
    };

    // `slowness` is 1/vs
    template <class R>
    [[gnu::always_inline]] static R level(R Tc, R Ts, R slowness, R w) {
        const R x = w * slowness;
        return Tc + (Ts - Tc) * exp_of_minus(x * x);
    }
};

}  // namespace gaident
