// Dry friction that changes with the angle, as of a bent screw or an uneven guide: -Tc (1 + a cos(n theta + phase)) sign(w).
// It holds still while the other torques stay below what it is at this angle.
#pragma once

#include "../effect.hpp"
#include "law.hpp"

namespace gaident {

struct PositionFriction {
    static constexpr EffectParameter parameters[] = {
        {"torque", "N m", 0.0, 0.0},
        {"amplitude", "1", any_value, 0.0, 1.0},
        {"order", "1/turn", any_value, 1.0},
        {"phase", "rad"},
    };
    static constexpr EffectInfo info{
        .name = "position_friction",
        .place = Place::shaft,
        .meaning = "dry friction that changes n times {per turn}: a bent screw, an uneven guide",
        .parameters = parameters,
        .turns = true,
        .remark = "amplitude is a share of its {torque}",
    };
    static constexpr Hooks hooks = Hooks::level_of_angle | Hooks::substeps;

    template <class R>
    struct Coefficients {
        R torque, change, order, phase;  // Tc, Tc a, n
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[0], p[0] * p[1], p[2], p[3]}; }
    static double substeps(const double* p, const Circumstances& at) { return at.for_turns(p[2]); }

    template <class R>
    [[gnu::always_inline]] static R level_of_angle(const Coefficients<R>& c, R theta) {
        return fma(c.change, cosine(fma(c.order, theta, c.phase)), c.torque);
    }
};

}  // namespace gaident
