// Dry friction of a gear or screw that grows with the load it carries: -(Tc + share abs(load)) sign(w).
//
// load: the torque with which the other effects at the shaft brake it, gravity for instance.
// W. Hamon, M. Gautier, P. Garrec, "Dynamic identification of robots with a dry friction model depending on load and velocity",
// IROS 2010.
#pragma once

#include "../effect.hpp"
#include "law.hpp"

namespace gaident {

struct LoadDependentFriction {
    static constexpr EffectParameter parameters[] = {{"torque", "N m", 0.0, 0.0}, {"share", "1", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "load_dependent_friction",
        .place = Place::shaft,
        .meaning = "dry friction of a gear that grows with the load it carries",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::loaded;

    template <class R>
    struct Coefficients {
        R torque, share;
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[0], p[1]}; }

    template <class R>
    [[gnu::always_inline]] static R loaded(const Coefficients<R>& c, R load) {
        return fma(c.share, absolute(load), c.torque);
    }
};

}  // namespace gaident
