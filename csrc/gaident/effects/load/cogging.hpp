// Torque ripple that depends on the angle: -A sin(n theta + phase).
#pragma once

#include "../effect.hpp"

namespace gaident {

struct Cogging {
    static constexpr EffectParameter parameters[] = {
        {"amplitude", "N m", 0.0, 0.0},
        {"order", "1/turn", any_value, 2.0},
        {"phase", "rad"},
    };
    static constexpr EffectInfo info{
        .name = "cogging",
        .place = Place::shaft,
        .meaning = "{torque} ripple n times {per turn}: slots and magnets, belts, gears",
        .parameters = parameters,
        .turns = true,
    };
    static constexpr Hooks hooks = Hooks::torque | Hooks::substeps;

    template <class R>
    struct Coefficients {
        R amplitude, order, phase;
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[0], p[1], p[2]}; }
    static double substeps(const double* p, const Circumstances& at) { return at.for_turns(p[1]); }

    template <class R>
    [[gnu::always_inline]] static R torque(const Coefficients<R>& c, R theta) {
        return c.amplitude * sine(fma(c.order, theta, c.phase));
    }
};

}  // namespace gaident
