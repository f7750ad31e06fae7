// Dahl's friction: an elastic bristle that breaks away, torque -s0 z,
//
//     dz/dt = w - abs(w) z/zc,   zc = Tc/s0
//
// solved as in bristle.hpp.
#pragma once

#include "../effect.hpp"
#include "bristle.hpp"

namespace gaident {

struct PreslidingFriction {
    static constexpr EffectParameter parameters[] = {
        {"torque", "N m", 0.0, 0.0},
        {"stiffness", "N m/rad", any_value, 0.0, infinite, true},
    };
    static constexpr EffectInfo info{
        .name = "presliding_friction",
        .place = Place::shaft,
        .meaning = "friction that is a spring over small motions before it slides (Dahl)",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::friction | Hooks::after_friction | Hooks::substeps;

    template <class R>
    struct Coefficients {
        R stiffness, per_break, limit;  // s0 [N m/rad], 1/zc [1/rad], zc [rad]
    };
    template <class R>
    using State = Bristle<R>;
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[1], p[1] / p[0], p[0] / p[1]}; }
    static double substeps(const double* p, const Circumstances& at) {
        return __builtin_sqrt(__builtin_fabs(at.inverse_inertia * p[1])) * at.sample_time / 0.3;
    }

    template <class R>
    [[gnu::always_inline]] static void friction(const Coefficients<R>& c, Bristle<R>& s, FrictionStep<R>& step) {
        s.weigh(step.h, (step.h * absolute(step.w)) * c.per_break, (step.beta * step.h) * c.stiffness);
        s.join(c.stiffness, c.per_break, step);
    }
    template <class R>
    [[gnu::always_inline]] static void after_friction(const Coefficients<R>& c, Bristle<R>& s, const FrictionStep<R>& step,
                                                      R w_next) {
        s.move(step, w_next, c.limit);
    }
};

}  // namespace gaident
