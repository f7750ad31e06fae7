// Dry friction: -Tc sign(w); holds still while the other torques stay below Tc.
#pragma once

#include "../effect.hpp"
#include "law.hpp"

namespace gaident {

struct CoulombFriction {
    static constexpr EffectParameter parameters[] = {{"torque", "N m", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "coulomb_friction",
        .place = Place::shaft,
        .meaning = "dry friction of constant size",
        .parameters = parameters,
        .remark = "holds still below it",
    };
    static constexpr Hooks hooks = Hooks::law;

    template <class R>
    struct Coefficients {
        R torque;
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.torque = p[0]; }

    template <class R>
    static void law(const Coefficients<R>& c, FrictionLaw<R>& friction) {
        friction.level_positive = friction.level_positive + c.torque;
        friction.level_negative = friction.level_negative + c.torque;
    }
};

}  // namespace gaident
