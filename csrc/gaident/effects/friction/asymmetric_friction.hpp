// Friction that differs with the direction: -(Tp + bp w) for w > 0, +(Tn + bn abs(w)) for w < 0, on top of the model's own damping.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct AsymmetricFriction {
    static constexpr EffectInfo info{"asymmetric_friction",
                                     Place::shaft,
                                     "dry and viscous friction that differ with the direction of motion",
                                     {{"torque_positive", "N m", 0.0, 0.0},
                                      {"torque_negative", "N m", 0.0, 0.0},
                                      {"viscous_positive", "N m s/rad", 0.0, 0.0},
                                      {"viscous_negative", "N m s/rad", 0.0, 0.0}}};

    template <class R>
    static void add(const R* p, FrictionLaw<R>& law) {
        law.level_positive = law.level_positive + p[0];
        law.level_negative = law.level_negative + p[1];
        law.viscous_positive = law.viscous_positive + p[2];
        law.viscous_negative = law.viscous_negative + p[3];
    }
};

}  // namespace gaident
