// Play in the coupling: no torque while abs(twist) < gap/2, then stiffness on the rest.
// As a correction to the linear coupling torque K x + D dx/dt:
//
//     c(x) = -K clamp(x, -gap/2, gap/2),   and inside the gap -D dx/dt as well
//
// Over a substep in which the twist goes evenly from x0 to x1 its mean is, with S the integral of clamp,
//
//     -K (S(x1) - S(x0))/(x1 - x0) - D dx/dt (clamp(x1) - clamp(x0))/(x1 - x0)
//
// so that contact begins and ends within the substep, not at its borders.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct Backlash {
    static constexpr EffectParameter parameters[] = {{"gap", "rad", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "backlash",
        .place = Place::coupling,
        .meaning = "play between motor and load",
        .parameters = parameters,
        .needs_two_masses = true,
        .remark = "gap is its full width",
    };
    static constexpr Hooks hooks = Hooks::coupling;

    template <class R>
    struct Coefficients {
        R half_gap;
    };
    static constexpr Pace pace = Pace::finer;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.half_gap = 0.5 * p[0]; }
    static double loaded_twist(const Coefficients<double>& c, double, double linear, double x) {
        return x + __builtin_copysign(c.half_gap, linear);
    }

    // Leaves in x what of the twist lies beyond the gap, for the effects that follow.
    template <class R>
    [[gnu::always_inline]] static R coupling(const Coefficients<R>& c, R K, R D, R& x, R dx) {
        const R damping = greater(c.half_gap, absolute(x), D * dx, R(0.0)), inside = clamp(x, -c.half_gap, c.half_gap);
        x = x - inside;
        return -fma(K, inside, damping);
    }
    template <class R>
    [[gnu::always_inline]] static R mean_coupling(const Coefficients<R>& c, R K, R D, R& x0, R& x1, R dx) {
        const R c0 = clamp(x0, -c.half_gap, c.half_gap), c1 = clamp(x1, -c.half_gap, c.half_gap), step = x1 - x0;
        // S = c (x - c/2)
        const R S = fma(c1, fnma(R(0.5), c1, x1), -(c0 * fnma(R(0.5), c0, x0)));
        // With almost no movement the quotient has no digits: there the mean of both ends is taken.
        const R shortest = R(1e-6) * c.half_gap;
        const R moves = absolute(step), per_step = R(1.0) / greater(moves, shortest, step, R(1.0));
        const R inside = greater(c.half_gap, absolute(x0), R(1.0), R(0.0));
        const R spring = greater(moves, shortest, S * per_step, R(0.5) * (c0 + c1));
        const R share = greater(moves, shortest, (c1 - c0) * per_step, inside);
        x0 = x0 - c0;
        x1 = x1 - c1;
        return -fma(K, spring, (D * dx) * share);
    }
};

}  // namespace gaident
