// Drag that grows with the square root of speed, as of a thin film that is sheared: -c sign(w) sqrt(abs(w)), 0 at rest.
//
// Its slope c/(2 sqrt(abs(w))) has no bound near w = 0, where no step resolves it.
// So the substep is implicit and solved exactly: in the direction of motion,
// with W = (w + w+)/2 the mean velocity and A what it would be without this drag,
//
//     W = A - b sqrt(W),   b = beta c/2     ->     sqrt(W) = 2 A/(b + sqrt(b^2 + 4 A)),   0 where A <= 0
//
// and c sqrt(W) is a level of the friction law (law.hpp), which is 0 at rest.
// It cannot reverse the motion: where the substep would, the velocity is exactly 0 from its stop on.
#pragma once

#include "../effect.hpp"
#include "law.hpp"

namespace gaident {

struct SquareRootDrag {
    static constexpr EffectParameter parameters[] = {{"coefficient", "N m s^0.5/rad^0.5", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "square_root_drag",
        .place = Place::shaft,
        .meaning = "drag that grows with the square root of speed",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::friction;

    template <class R>
    struct Coefficients {
        R coefficient;
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.coefficient = p[0]; }

    template <class R, class Memory>
    [[gnu::always_inline]] static void friction(const Coefficients<R>& c, Memory&, FrictionStep<R>& step) {
        const R zero = R(0.0), one = R(1.0), half = R(0.5);
        const R speed = absolute(step.w), way = greater(speed, zero, step.w, step.w_free);
        const R level = greater(way, zero, step.law.level_positive, step.law.level_negative);
        R ahead = fnma(step.beta, level, greater(way, zero, step.w_free, zero - step.w_free)),
          b = (step.beta * half) * c.coefficient;
        if (step.law.steep) {
            const R B = greater(way, zero, step.law.viscous_positive, step.law.viscous_negative) * half;
            const R per = one / fma(step.beta, fma(step.law.drag, speed, B), one);
            ahead = fnma(step.beta * B, speed, ahead) * per;
            b = b * per;
        }
        const R A = (speed + ahead) * half;
        const R root = greater(A, zero, (A + A) / (b + square_root(fma(b, b, R(4.0) * A))), zero);
        const R drag = c.coefficient * root;
        step.law.level_positive = step.law.level_positive + drag;
        step.law.level_negative = step.law.level_negative + drag;
        step.law.more_at_rest = step.law.more_at_rest - drag;
    }
};

}  // namespace gaident
