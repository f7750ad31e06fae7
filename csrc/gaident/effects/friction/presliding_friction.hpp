// Dahl's friction: an elastic bristle that breaks away, torque -s0 z,
//
//     dz/dt = w - abs(w) z/zc,   zc = Tc/s0
//
// Over one substep h, solved jointly with the velocity (with the old one it would ring). With W and zm the mean velocity and deflection,
//
//     zm = (z + e W)/(1 + e abs(W)/zc),  e = theta h,     W = w + theta (w+ - w),     w+ = w_free - beta s0 zm
//
// which is a quadratic in abs(W) with one positive root. theta is 1/2 (second order) where the substep resolves the bristle and goes
// towards 1 where it does not: r = h abs(w)/zc fits the exact decay in angle, beta h s0 the resonance of the inertia on the bristle.
#pragma once

#include "../../numeric/elementary.hpp"
#include "../effect.hpp"

namespace gaident {

struct PreslidingFriction {
    static constexpr EffectInfo info{"presliding_friction",
                                     Place::shaft,
                                     "friction that is a spring over small angles before it slides (Dahl)",
                                     {{"torque", "N m", 0.0, 0.0}, {"stiffness", "N m/rad", any_value, 0.0, infinite, true}}};
};

template <class R>
struct Bristle {
    R torque = R(0.0), stiffness = R(0.0);  // Tc [N m], s0 [N m/rad]
    R per_break = R(0.0);                   // 1/zc [1/rad]
    R z = R(0.0);                           // deflection [rad]
    R theta = R(0.5), e = R(0.0), one_plus = R(1.0);

    // Puts the bristle into w+ = w_free - beta f: afterwards f stands for the other friction alone. `other` is its torque one
    // substep ago, good enough for choosing abs(W).
    [[gnu::always_inline]] void join(R h, R w, R other, R& w_free, R& beta) {
        const R one = R(1.0), two = R(2.0), four = R(4.0), zero = R(0.0);
        const R r = (h * absolute(w)) * per_break, spring = (beta * h) * stiffness;
        theta = one - one / (((two + r * R(1.0 / 3.0)) + (r * r) * R(0.058)) + spring * R(0.5));
        e = theta * h;
        const R ez = e * per_break, k = (theta * beta) * stiffness;
        const R A = w + theta * ((w_free - w) - beta * other);
        const R drive = A - k * z;
        const R c = absolute(drive), b = (one + k * e) - greater(drive, zero, A, zero - A) * ez;
        const R q = absolute(b) + square_root(b * b + (four * ez) * c);
        const R V = greater(b, zero, (two * c) / q, q / (two * ez));
        one_plus = one + ez * V;
        const R offset = (stiffness * z) / one_plus, slope = (stiffness * e) / one_plus;
        const R stiffer = one + (beta * slope) * theta;
        w_free = (w_free - beta * (offset + (slope * (one - theta)) * w)) / stiffer;
        beta = beta / stiffer;
    }

    // After the velocity is known.
    [[gnu::always_inline]] void move(R w, R w_next) {
        const R W = w + theta * (w_next - w);
        const R zm = (z + e * W) / one_plus;
        const R limit = R(1.0) / per_break;
        z = clamp(z + (zm - z) / theta, -limit, limit);
    }
};

}  // namespace gaident
