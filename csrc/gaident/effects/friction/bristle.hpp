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

template <class R>
struct Bristle {
    R z;                   // rad
    R other;               // the other friction's torque one substep ago [N m]
    R theta, e, one_plus;  // of the substep being solved

    // theta towards 1 where the substep does not resolve the bristle.
    // `decay`, the share of it that decays in the substep, fits the exact decay (W. Liniger, R. A. Willoughby,
    // Efficient integration methods for stiff systems of ordinary differential equations, SIAM J. Numer. Anal. 7, 1970).
    // `spring` = beta h s0 is the resonance of the inertia on the bristle.
    [[gnu::always_inline]] void weigh(R h, R decay, R spring) {
        const R one = R(1.0);
        theta = one - one / (((R(2.0) + decay * R(1.0 / 3.0)) + (decay * decay) * R(0.058)) + spring * R(0.5));
        e = theta * h;
    }

    // Puts the torque k zm into w+ = w_free - beta f: afterwards f stands for the other friction alone.
    // Its torque one substep ago is good enough for choosing abs(W).
    [[gnu::always_inline]] void join(R k, R per_break, FrictionStep<R>& step) {
        const R one = R(1.0), two = R(2.0), four = R(4.0), zero = R(0.0);
        const R ez = e * per_break, kb = (theta * step.beta) * k;
        const R A = step.w + theta * ((step.w_free - step.w) - step.beta * other);
        const R drive = A - kb * z;
        const R c = absolute(drive), b = (one + kb * e) - greater(drive, zero, A, zero - A) * ez;
        const R q = absolute(b) + square_root(b * b + (four * ez) * c);
        const R V = greater(b, zero, (two * c) / q, q / (two * ez));
        one_plus = one + ez * V;
        const R offset = (k * z) / one_plus, slope = (k * e) / one_plus;
        const R stiffer = one + (step.beta * slope) * theta;
        step.w_free = (step.w_free - step.beta * (offset + (slope * (one - theta)) * step.w)) / stiffer;
        step.beta = step.beta / stiffer;
    }

    // After the velocity is known; `limit`: the largest deflection.
    [[gnu::always_inline]] void move(const FrictionStep<R>& step, R w_next, R limit) {
        other = (step.w_free - w_next) / step.beta;
        const R W = step.w + theta * (w_next - step.w);
        const R zm = (z + e * W) / one_plus;
        z = clamp(z + (zm - z) / theta, -limit, limit);
    }
};

}  // namespace gaident
