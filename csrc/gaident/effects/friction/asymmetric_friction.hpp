// Friction that differs with the direction, on top of the model's own damping:
//
//     -(Tp + bp w) for w > 0,   +(Tn + bn abs(w)) for w < 0
#pragma once

#include "../effect.hpp"
#include "law.hpp"

namespace gaident {

struct AsymmetricFriction {
    static constexpr EffectParameter parameters[] = {
        {"torque_positive", "N m", 0.0, 0.0},
        {"torque_negative", "N m", 0.0, 0.0},
        {"viscous_positive", "N m s/rad", 0.0, 0.0},
        {"viscous_negative", "N m s/rad", 0.0, 0.0},
    };
    static constexpr EffectInfo info{
        .name = "asymmetric_friction",
        .place = Place::shaft,
        .meaning = "dry and viscous friction that differ with the direction of motion",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::law;

    template <class R>
    struct Coefficients {
        R torque_positive, torque_negative, viscous_positive, viscous_negative;
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[0], p[1], p[2], p[3]}; }

    template <class R>
    static void law(const Coefficients<R>& c, FrictionLaw<R>& friction) {
        friction.level_positive = friction.level_positive + c.torque_positive;
        friction.level_negative = friction.level_negative + c.torque_negative;
        friction.viscous_positive = friction.viscous_positive + c.viscous_positive;
        friction.viscous_negative = friction.viscous_negative + c.viscous_negative;
        friction.steep = true;
    }
};

}  // namespace gaident
