// The controller's integrator is limited: abs(I) <= limit, after each update.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct IntegratorClamp {
    static constexpr EffectParameter parameters[] = {{"limit", "N m", infinite, 0.0, infinite, true}};
    static constexpr EffectInfo info{
        .name = "integrator_clamp",
        .place = Place::controller,
        .meaning = "the controller's integrator is limited",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::controller;

    template <class R>
    struct Coefficients {
        R limit;
    };
    static constexpr Pace pace = Pace::sample;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.limit = p[0]; }

    template <class R>
    static void controller(const Coefficients<R>& c, ControllerState<R>& pi) {
        pi.integrator_limit = minimum(pi.integrator_limit, c.limit);
    }
};

}  // namespace gaident
