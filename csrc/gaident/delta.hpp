// A discrete transfer function in delta = z - 1,
//
//     H(delta) = (b[0] delta^N + b[1] delta^(N-1) + ... + b[N]) / (delta^N + a[0] delta^(N-1) + ... + a[N-1]).
//
// In powers of z the poles of a fast-sampled loop crowd at z = 1 and cancellation destroys the coefficients (METHOD.md section 1: more
// than half of random order-7 models wrong by over 1 % in 32 bits). In delta, with every polynomial *built* in delta, nothing cancels.
#pragma once

#include "factors.hpp"

namespace gaident {

inline constexpr int max_loop_order = max_plant_order + 1;

template <class R>
struct Delta {
    int order = 0;
    R a[max_loop_order]{};
    R b[max_loop_order + 1]{};
};

// Whether 24 bits hold the polynomial delta^N + a[0] delta^(N-1) + ...: rounding a[i] moves it, where |z| = 1 and so |delta| <= 2, by up to
// 2^-24 |a[i]| |delta|^(N-1-i). The sum of these, relative to delta^N at its largest, is 2^-24 (k - 1) with
//
//     k = 1 + sum_i |a[i]| 2^-(i+1)        (1 with all poles at z = 1, 2^N with all at z = -1)
//
// Over 180,000 random loops up to order 7, roots up to 1.6 times the Nyquist frequency, stable and unstable, k <= 1.75 kept float within
// 1e-4 of the response but for one (an unstable pole hidden under a zero); beyond k = 4 one in ten is off by more. A servo axis sampled as
// it should be has k below 1.5.
template <class A>
bool float_suffices(int order, A&& a) {
    double k = 1.0, scale = 0.5;
    for (int i = 0; i < order; ++i, scale *= 0.5) k += std::abs(a(i)) * scale;
    return k <= 1.75;
}

// A polynomial c[0] x^n + ... + c[n], grown factor by factor.
template <class R>
struct Polynomial {
    int degree = 0;
    R c[max_loop_order + 1]{};

    explicit Polynomial(R leading) { c[0] = leading; }

    // times (k1 x + k0)
    void times(R k1, R k0) {
        R previous = R(0.0);
        for (int i = 0; i <= degree; ++i) {
            const R here = c[i];
            c[i] = k1 * here + k0 * previous;
            previous = here;
        }
        c[++degree] = k0 * previous;
    }

    // times (k2 x^2 + k1 x + k0)
    void times(R k2, R k1, R k0) {
        R first = R(0.0), second = R(0.0);
        for (int i = 0; i <= degree; ++i) {
            const R here = c[i];
            c[i] = (k2 * here + k1 * first) + k0 * second;
            second = first;
            first = here;
        }
        c[degree + 1] = k1 * first + k0 * second;
        c[degree + 2] = k0 * first;
        degree += 2;
    }
};

}  // namespace gaident
