// An inertia that changes with its angle, as of a crank or an arm: J (1 + a cos(psi)), psi = n theta + phase. With J' its slope,
//
//     J(theta) dw/dt + J'(theta) w^2/2 = T                      (Lagrange's equation of the kinetic energy J(theta) w^2/2)
//
// so that beside the constant J a torque acts, T_a = -J a cos(psi) dw/dt + (J a n/2) sin(psi) w^2.
// Over a substep h, psi in its middle and w^2 = w w+, the equation w+ = w_free - beta f becomes
//
//     w+ (1 + beta (D - s w)) = w_free + beta D w - beta f,   D = J a cos(psi)/h,   s = (J a n/2) sin(psi)
//
// of second order, too.
#pragma once

#include "../effect.hpp"
#include "../friction/law.hpp"

namespace gaident {

struct PositionInertia {
    static constexpr EffectParameter parameters[] = {
        {"amplitude", "1", 0.0, 0.0, 0.999},
        {"order", "1/turn", any_value, 1.0},
        {"phase", "rad"},
    };
    static constexpr EffectInfo info{
        .name = "position_inertia",
        .place = Place::mechanism,
        .meaning = "{inertia} of the load that changes n times {per turn}: cranks, arms",
        .parameters = parameters,
        .turns = true,
        .remark = "amplitude is a share of the load's {inertia}, or of all with one mass",
    };
    static constexpr Hooks hooks = Hooks::inertia | Hooks::substeps;

    template <class R>
    struct Coefficients {
        R change, bend, order, phase;  // J a/h [N m s/rad], J a n/2 [N m s^2/rad^2]
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor& made, Coefficients<double>& c) {
        const double change = made.inertia * p[0];
        c = {change / made.step, 0.5 * change * p[1], p[1], p[2]};
    }
    static double substeps(const double* p, const Circumstances& at) { return at.for_turns(p[1]); }

    template <class R>
    [[gnu::always_inline]] static void inertia(const Coefficients<R>& c, R theta, FrictionStep<R>& step) {
        const R psi = fma(c.order, theta, c.phase), change = c.change * cosine(psi), bend = c.bend * sine(psi);
        const R per = R(1.0) / fma(step.beta, fnma(bend, step.w, change), R(1.0));
        step.w_free = fma(step.beta * change, step.w, step.w_free) * per;
        step.beta = step.beta * per;
    }
};

}  // namespace gaident
