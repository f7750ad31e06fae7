// A coupling that loses energy in every cycle of its twist x: a Dahl element beside its stiffness, and beside its play where it
// has one, with a deflection z [rad] of its own. To the coupling's torque it adds s0 z,
//
//     dz/dt = v (1 - s0 z sign(v)/Tc),   v = dx/dt
//
// (P. R. Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14, 1976).
// It is a spring s0 over small motions, and dry friction Tc between motor and load over large ones.
// z depends on the way of the twist and not on time. Along a way in one direction d = sign(x1 - x0), with a = abs(x1 - x0) s0/Tc,
//
//     z1 = z0 + (d - z0 s0/Tc) abs(x1 - x0) (1 - a m),   mean of z: z0 + (d - z0 s0/Tc) abs(x1 - x0) m,   m = (a - 1 + e^-a)/a^2
//
// exactly, however short the way is on which the element yields.
// Where the record begins in motion, the element was wound from x = 0 to the twist there.
#pragma once

#include "../../plant/two_mass.hpp"
#include "../effect.hpp"

namespace gaident {

struct HystereticCoupling {
    static constexpr EffectParameter parameters[] = {
        {"torque", "N m", 0.0, 0.0},
        {"stiffness", "N m/rad", any_value, 0.0, infinite, true},
    };
    static constexpr EffectInfo info{
        .name = "hysteretic_coupling",
        .place = Place::coupling,
        .meaning = "coupling whose {torque} lags behind its {twist}: harmonic drives, belts (Dahl)",
        .parameters = parameters,
        .needs_two_masses = true,
    };
    static constexpr Hooks hooks = Hooks::hysteresis | Hooks::substeps;

    template <class R>
    struct Coefficients {
        R stiffness, per_break;  // s0 [N m/rad], s0/Tc [1/rad]
    };
    template <class R>
    struct State {
        R z, x;  // deflection, and the twist to which it belongs [rad]
    };
    static constexpr Pace pace = Pace::finer;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[1], p[1] / p[0]}; }
    // The masses swing on this spring, too.
    static double substeps(const double* p, const Circumstances& at) {
        TwoMasses m{};
        if (!two_masses_of(at.plant, m)) return 1.0;
        const double stiffness = __builtin_fabs(m.KG) + p[1];
        return __builtin_sqrt(stiffness * __builtin_fabs(1.0 / m.JM + 1.0 / m.JL)) * at.sample_time / 0.0215;
    }

    // (a - 1 + e^-a)/a^2 for a >= 0; where the difference has few digits its series.
    template <class R>
    [[gnu::always_inline]] static R mean_share(R a) {
        R series = R(0.0);
        for (int k = 11; k >= 2; --k) series = fnma(a, series, R(1.0)) * R(1.0 / k);
        const R one = R(1.0), far = greater(a, R(0.125), a, one);
        return greater(a, R(0.125), (far - (one - exp_of_minus(far))) / (far * far), series);
    }

    // The torque at the twist x, to which it has gone evenly.
    template <class R>
    [[gnu::always_inline]] static R wound(const Coefficients<R>& c, State<R>& s, R x) {
        const R way = x - s.x, length = absolute(way), a = length * c.per_break;
        const R left = fnma(a, mean_share(a), R(1.0));
        s.z = fma(fnma(s.z * c.per_break, length, way), left, s.z);
        s.x = x;
        return c.stiffness * s.z;
    }
    // Its mean along a twist that goes evenly from there to x.
    template <class R>
    [[gnu::always_inline]] static R mean_wound(const Coefficients<R>& c, const State<R>& s, R x) {
        const R way = x - s.x, length = absolute(way);
        return c.stiffness * fma(fnma(s.z * c.per_break, length, way), mean_share(length * c.per_break), s.z);
    }
    // The twist at which K x and the element, wound from 0, carry what the linear coupling carries: Newton's steps from 0, all of
    // them short of it.
    static double loaded_twist(const Coefficients<double>& c, double K, double linear, double) {
        double x = 0.0;
        const double wanted = K * __builtin_fabs(linear);
        for (int i = 0; i < 50; ++i) {
            const double bent = exp_of_minus(x * c.per_break);
            x += (wanted - K * x - c.stiffness / c.per_break * (1.0 - bent)) / (K + c.stiffness * bent);
        }
        return __builtin_copysign(x, linear);
    }
};

}  // namespace gaident
