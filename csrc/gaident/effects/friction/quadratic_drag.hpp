// Drag of air or fluid: -c w abs(w).
#pragma once

#include "../effect.hpp"

namespace gaident {

struct QuadraticDrag {
    static constexpr EffectInfo info{"quadratic_drag",
                                     Place::shaft,
                                     "drag of a fan or fluid, growing with the square of speed",
                                     {{"coefficient", "N m s^2/rad^2", 0.0, 0.0}}};

    template <class R>
    static void add(const R* p, FrictionLaw<R>& law) {
        law.drag = law.drag + p[0];
    }
};

}  // namespace gaident
