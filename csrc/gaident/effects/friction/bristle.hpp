// An elastic bristle between the shaft and the housing, its deflection z [rad] bent by the motion and breaking away,
//
//     dz/dt = w - abs(w) z/zc
//
// over one substep h, solved jointly with the velocity (with the velocity of the substep before, the solution would oscillate).
// With W and zm the mean velocity and deflection,
//
//     zm = (z + e W)/(1 + e abs(W)/zc),  e = theta h,     W = w + theta (w+ - w),     w+ = w_free - beta k zm
//
// which is a quadratic in abs(W) with one positive root: the theta method, solved exactly, stable at any step for theta >= 1/2.
#pragma once

#include "law.hpp"

namespace gaident {

// With P = 1 + e abs(W)/zc this is linear in the velocities:
//
//     w+ = (P w_free - beta k (z + e (1 - theta) w) - P beta f)/(P + beta k e theta),   f the other friction
template <class R>
struct Bristle {
    R z;                                        // rad
    R other;                                    // the other friction's torque one substep ago [N m]
    R theta, per_theta, e, per_plus, per_beta;  // of the substep being solved: 1/theta, 1/P, 1/beta of the other friction

    // theta towards 1 where the substep does not resolve the bristle.
    // `decay`, the share of it that decays in the substep, fits the exact decay (W. Liniger, R. A. Willoughby,
    // Efficient integration methods for stiff systems of ordinary differential equations, SIAM J. Numer. Anal. 7, 1970).
    // `spring` = beta h s0 is the resonance of the inertia on the bristle.
    [[gnu::always_inline]] void weigh(R h, R decay, R spring) {
        const R one = R(1.0);
        const R D = fma(decay, fma(decay, R(0.058), R(1.0 / 3.0)), fma(spring, R(0.5), R(2.0)));
        theta = one - one / D;
        per_theta = D / (D - one);
        e = theta * h;
    }

    // Puts the torque k zm into w+ = w_free - beta f: afterwards f stands for the other friction alone.
    // Its torque one substep ago is good enough for choosing abs(W).
    [[gnu::always_inline]] void join(R k, R per_break, FrictionStep<R>& step) {
        const R one = R(1.0), two = R(2.0), half = R(0.5), zero = R(0.0);
        const R ez = e * per_break, kb = (theta * step.beta) * k;
        const R A = fma(theta, fnma(step.beta, other, step.w_free - step.w), step.w);
        const R drive = fnma(kb, z, A);
        const R c2 = two * (ez * absolute(drive)), b = fnma(greater(drive, zero, A, zero - A), ez, fma(kb, e, one));
        // P - 1, the positive root of x^2 + b x - c2/2
        const R q = absolute(b) + square_root(fma(b, b, two * c2));
        const R P = one + greater(b, zero, c2 / q, q * half);
        per_plus = one / P;
        const R per = one / fma(kb, e, P), P_beta = P * step.beta;
        const R bent = fma(e - e * theta, step.w, z);
        step.w_free = fnma(step.beta * k, bent, P * step.w_free) * per;
        per_beta = fma(kb, e, P) / P_beta;
        step.beta = P_beta * per;
    }

    // After the velocity is known; `limit`: the largest deflection.
    [[gnu::always_inline]] void move(const FrictionStep<R>& step, R w_next, R limit) {
        other = (step.w_free - w_next) * per_beta;
        const R W = fma(theta, w_next - step.w, step.w);
        const R zm = fma(e, W, z) * per_plus;
        z = clamp(fma(zm - z, per_theta, z), -limit, limit);
    }
};

}  // namespace gaident
