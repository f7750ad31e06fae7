// Dry friction: -Tc sign(w); holds still while the other torques stay below Tc.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct CoulombFriction {
    static constexpr EffectInfo info{
        "coulomb_friction", Place::shaft, "dry friction of constant size; holds still below it", {{"torque", "N m", 0.0, 0.0}}};

    template <class R>
    static void add(const R* p, FrictionLaw<R>& law) {
        law.level_positive = law.level_positive + p[0];
        law.level_negative = law.level_negative + p[0];
    }
};

}  // namespace gaident
