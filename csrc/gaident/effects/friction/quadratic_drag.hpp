// Drag of air or fluid: -c w abs(w).
#pragma once

#include "../effect.hpp"
#include "law.hpp"

namespace gaident {

struct QuadraticDrag {
    static constexpr EffectParameter parameters[] = {{"coefficient", "N m s^2/rad^2", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "quadratic_drag",
        .place = Place::shaft,
        .meaning = "drag of a fan or fluid, growing with the square of speed",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::law;

    template <class R>
    struct Coefficients {
        R coefficient;
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.coefficient = p[0]; }

    template <class R>
    static void law(const Coefficients<R>& c, FrictionLaw<R>& friction) {
        friction.drag = friction.drag + c.coefficient;
        friction.steep = true;
    }
};

}  // namespace gaident
