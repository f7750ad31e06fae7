// Dry friction that falls from its static level as motion begins: -(Tc + (Ts - Tc) exp(-(w/vs)^2)) sign(w).
#pragma once

#include "../effect.hpp"
#include "law.hpp"

namespace gaident {

struct StribeckFriction {
    static constexpr EffectParameter parameters[] = {
        {"torque", "N m", 0.0, 0.0},
        {"static_torque", "N m", 0.0, 0.0},
        {"stribeck_velocity", "rad/s", any_value, 0.0, infinite, true},
    };
    static constexpr EffectInfo info{
        .name = "stribeck_friction",
        .place = Place::shaft,
        .meaning = "dry friction, larger at standstill and falling as motion begins",
        .parameters = parameters,
        .allowed = [](const double* p) { return p[1] >= p[0]; },
        .relation = "static_torque must be at least torque",
    };
    static constexpr Hooks hooks = Hooks::friction | Hooks::begin;

    template <class R>
    struct Coefficients {
        R torque, static_torque, slowness;  // Tc, Ts, 1/vs
    };
    template <class R>
    struct State {
        R w_before;  // rad/s
    };
    // A friction that falls with speed drives a resonance.
    static constexpr Pace pace = Pace::finer;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[0], p[1], 1.0 / p[2]}; }
    template <class R>
    static void begin(const Coefficients<R>&, State<R>& s, const Beginning<R>& start) {
        s.w_before = start.velocity;
    }

    template <class R>
    [[gnu::always_inline]] static R level_at(const Coefficients<R>& c, R w) {
        const R x = w * c.slowness;
        return fma(c.static_torque - c.torque, exp_of_minus(x * x), c.torque);
    }
    // The level at the mean velocity, which is foreseen, but never beyond a stop: at rest the static level holds.
    template <class R>
    [[gnu::always_inline]] static void friction(const Coefficients<R>& c, State<R>& s, FrictionStep<R>& step) {
        const R zero = R(0.0), w = step.w, foreseen = fma(w - s.w_before, R(0.5), w);
        const R at = level_at(c, greater(w * foreseen, zero, foreseen, zero));
        step.law.level_positive = step.law.level_positive + at;
        step.law.level_negative = step.law.level_negative + at;
        step.law.more_at_rest = c.static_torque - at;
        s.w_before = w;
    }
};

}  // namespace gaident
