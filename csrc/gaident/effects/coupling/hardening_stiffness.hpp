// A coupling that stiffens with its twist x: torque K x + k3 x^3, x less half the gap where there is backlash too.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct HardeningStiffness {
    static constexpr EffectParameter parameters[] = {{"cubic_stiffness", "N m/rad^3", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "hardening_stiffness",
        .place = Place::coupling,
        .meaning = "coupling that grows stiffer with its {twist}",
        .parameters = parameters,
        .needs_two_masses = true,
    };
    static constexpr Hooks hooks = Hooks::coupling;

    template <class R>
    struct Coefficients {
        R cubic;
    };
    static constexpr Pace pace = Pace::finer;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.cubic = p[0]; }
    // The twist x at which K x + k3 x^3 is what the linear coupling carries.
    static double loaded_twist(const Coefficients<double>& c, double K, double linear, double x) {
        for (int i = 0; i < 50 && c.cubic > 0.0; ++i) x -= (K * (x - linear) + c.cubic * x * x * x) / (K + 3.0 * c.cubic * x * x);
        return x;
    }

    template <class R>
    [[gnu::always_inline]] static R coupling(const Coefficients<R>& c, R, R, R& x, R) {
        return ((c.cubic * x) * x) * x;
    }
    template <class R>
    [[gnu::always_inline]] static R mean_coupling(const Coefficients<R>& c, R, R, R& x0, R& x1, R) {
        return fma((c.cubic * x1) * x1, x1, ((c.cubic * x0) * x0) * x0) * R(0.5);
    }
};

}  // namespace gaident
