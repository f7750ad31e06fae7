// A discrete transfer function in delta = z - 1,
//
//     H(delta) = (b[0] delta^N + b[1] delta^(N-1) + ... + b[N]) / (delta^N + a[0] delta^(N-1) + ... + a[N-1]).
//
// In powers of z the poles of a fast-sampled loop lie close together at z = 1 and cancellation destroys the coefficients (more
// than half of random order-7 models are wrong by over 1 % in 32 bits).
// In delta, with every polynomial *built* in delta, nothing cancels.
#pragma once

#include "factors.hpp"

namespace gaident {

inline constexpr int max_loop_order = max_plant_order + 1;

// Room for coefficients of an order known at compile time, or of any (N = -1).
constexpr int room_for(int N) { return N < 0 ? max_loop_order : (N == 0 ? 1 : N); }

template <class R, int N = -1>
struct Delta {
    int order = 0;
    R a[room_for(N)]{};
    R b[room_for(N) + 1]{};
};

// Whether 24 bits represent the polynomial delta^N + a[0] delta^(N-1) + ...: rounding a[i] moves it, where |z| = 1 and so
// |delta| <= 2, by up to 2^-24 |a[i]| |delta|^(N-1-i).
// The sum of these, relative to delta^N at its largest, is 2^-24 (k - 1) with
//
//     k = 1 + sum_i |a[i]| 2^-(i+1)        (1 with all poles at z = 1, 2^N with all at z = -1)
//
// Over 500,000 random loops up to order 7, roots up to 1.6 times the Nyquist frequency, stable and unstable, k <= 1.6 kept float
// within 1e-4 of the response but for one (5e-3: an unstable pole hidden under a zero); beyond k = 4 one in ten is off by more.
// A servo axis sampled as it should be has k below 1.6.
template <class A>
bool float_suffices(int order, A&& a) {
    double k = 1.0, scale = 0.5;
    for (int i = 0; i < order; ++i, scale *= 0.5) k += (a(i) < 0.0 ? -a(i) : a(i)) * scale;
    return k <= 1.6;
}

// The leading coefficients c[0] x^n + c[1] x^(n-1) + ... + c[terms - 1] ... of a product, factor by factor.
// (Those beyond are not needed: a numerator of lanes of different structures has more.)
template <class R, int N = -1>
struct Polynomial {
    int terms;
    R c[room_for(N) + 1];

    Polynomial(R leading, int order) : terms((N >= 0 ? N : order) + 1) {
        c[0] = leading;
        for (int i = 1; i < size(); ++i) c[i] = R(0.0);
    }
    int size() const { return N >= 0 ? N + 1 : terms; }

    // times (k1 x + k0)
    void times(R k1, R k0) {
        for (int i = size() - 1; i > 0; --i) c[i] = fma(k0, c[i - 1], k1 * c[i]);
        c[0] = k1 * c[0];
    }

    // times (k2 x^2 + k1 x + k0)
    void times(R k2, R k1, R k0) {
        for (int i = size() - 1; i > 1; --i) c[i] = fma(k0, c[i - 2], fma(k1, c[i - 1], k2 * c[i]));
        if (size() > 1) c[1] = fma(k1, c[0], k2 * c[1]);
        c[0] = k2 * c[0];
    }
};

}  // namespace gaident
