// LuGre friction: a bristle with damping of its own, whose break-away falls with the velocity (C. Canudas de Wit, H. Olsson,
// K. J. Astrom, P. Lischinsky, A new model for control of systems with friction, IEEE Trans. Automatic Control 40, 1995).
// Its torque is
//
//     -(s0 z + s1 dz/dt),   dz/dt = w - s0 abs(w) z/g(w),   g(w) = Tc + (Ts - Tc) exp(-(w/vs)^2)
//
// beside the model's own viscous damping.
// It is stiff: z decays at s0 abs(w)/g, which no log resolves, and an explicit step diverges (L. Freidovich, A. Robertsson,
// A. Shiriaev, R. Johansson, LuGre-model-based friction compensation, IEEE Trans. Control Systems Technology 18, 2010).
// So the substep is implicit and solved exactly (bristle.hpp), with g taken at the mean velocity, which is foreseen.
// With zm = z + e dz/dt the torque's mean is (s0 + s1/e) zm - (s1/e) z, a bristle of the stiffness s0 + s1/e.
#pragma once

#include "../effect.hpp"
#include "bristle.hpp"

namespace gaident {

struct LugreFriction {
    static constexpr EffectParameter parameters[] = {
        {"torque", "N m", 0.0, 0.0},
        {"static_torque", "N m", 0.0, 0.0},
        {"stribeck_velocity", "rad/s", any_value, 0.0, infinite, true},
        {"stiffness", "N m/rad", any_value, 0.0, infinite, true},
        {"damping", "N m s/rad", any_value, 0.0},
    };
    static constexpr EffectInfo info{
        .name = "lugre_friction",
        .place = Place::shaft,
        .meaning = "friction of damped bristles that slide more easily in motion (LuGre)",
        .parameters = parameters,
        .allowed = [](const double* p) { return p[1] >= p[0]; },
        .relation = "static_torque must be at least torque",
    };
    static constexpr Hooks hooks = Hooks::friction | Hooks::after_friction | Hooks::begin | Hooks::substeps;

    template <class R>
    struct Coefficients {
        R torque, static_torque, slowness, stiffness, damping;  // Tc, Ts, 1/vs, s0, s1
        R damping_per_step, limit;                              // s1/h, Ts/s0
    };
    template <class R>
    struct State : Bristle<R> {
        R w_before;  // rad/s
    };
    static constexpr Pace pace = Pace::finer;
    static void prepare(const double* p, const PreparedFor& time, Coefficients<double>& c) {
        c = {p[0], p[1], 1.0 / p[2], p[3], p[4], p[4] / time.step, p[1] / p[3]};
    }
    static double substeps(const double* p, const Circumstances& at) {
        return __builtin_sqrt(__builtin_fabs(at.inverse_inertia * p[3])) * at.sample_time / 0.3;
    }
    template <class R>
    static void begin(const Coefficients<R>&, State<R>& s, const Beginning<R>& start) {
        s.w_before = start.velocity;
    }

    template <class R>
    [[gnu::always_inline]] static void friction(const Coefficients<R>& c, State<R>& s, FrictionStep<R>& step) {
        const R zero = R(0.0), w = step.w, foreseen = fma(w - s.w_before, R(0.5), w);
        const R x = greater(w * foreseen, zero, foreseen, zero) * c.slowness;
        const R g = maximum(fma(c.static_torque - c.torque, exp_of_minus(x * x), c.torque), R(1e-6) * c.static_torque);
        const R per_break = c.stiffness / g;
        s.weigh(step.h, fma(step.h * absolute(w), per_break, step.beta * c.damping), (step.beta * step.h) * c.stiffness);
        const R bending = c.damping_per_step * s.per_theta;
        step.w_free = fma(step.beta * bending, s.z, step.w_free);
        s.join(c.stiffness + bending, per_break, step);
        s.w_before = w;
    }
    template <class R>
    [[gnu::always_inline]] static void after_friction(const Coefficients<R>& c, State<R>& s, const FrictionStep<R>& step,
                                                      R w_next) {
        s.move(step, w_next, c.limit);
    }
};

}  // namespace gaident
