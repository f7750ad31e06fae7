// The bilinear transformation s = (2/Ts) (z-1)/(z+1) of a plant, built in delta = z - 1: with s' = s Ts/2 = delta/(delta+2),
//
//     s' + a            ->  ((1+a) delta + 2a) / (delta+2)
//     s'^2 + e1 s' + e0 ->  ((1+e1+e0) delta^2 + (2 e1 + 4 e0) delta + 4 e0) / (delta+2)^2
//     G(s) = K prod (s+b)/prod (s+a)  =  K (Ts/2)^p (delta+2)^p prod zeros / prod poles.
//
// Roots are in units of 2/Ts here (a' = a Ts/2), so no power of a large 2/Ts appears.
#pragma once

#include "delta.hpp"

namespace gaident {

// What the i-th of the p poles in excess of zeros brings to a product. Lanes of mixed structures overload it.
template <class R>
R excess(const Factors<R>&, int, R factor, R) {
    return factor;
}

// `N`: the plant's order when known at compile time, so that the loops over coefficients unroll; -1 otherwise.
template <class R, int N, class Plant>
Delta<R, N> bilinear_plant(const Plant& g, double sample_time) {
    const Counts s = g.counts();
    const int n = N >= 0 ? N : s.order;
    const R h = R(0.5 * sample_time), one = R(1.0), two = R(2.0), four = R(4.0);

    R gain = g.gain;
    for (int i = 0; i < s.p; ++i) gain = gain * excess(g, i, h, one);

    Polynomial<R, N> denominator(one, n), numerator(one, n);
    for (int i = 0; i < s.pole_pairs; ++i) {
        const R e1 = g.pole_pair[i].e1 * h, e0 = (g.pole_pair[i].e0 * h) * h;
        const R scale = one / ((one + e1) + e0);
        denominator.times(one, fma(four, e0, two * e1) * scale, (four * e0) * scale);
        gain = gain * scale;
    }
    if (s.single_pole) {
        const R a = g.pole * h, scale = one / (one + a);
        denominator.times(one, (two * a) * scale);
        gain = gain * scale;
    }
    for (int i = 0; i < s.zero_pairs; ++i) {
        const R e1 = g.zero_pair[i].e1 * h, e0 = (g.zero_pair[i].e0 * h) * h;
        numerator.times((one + e1) + e0, fma(four, e0, two * e1), four * e0);
    }
    if (s.single_zero) {
        const R b = g.zero * h;
        numerator.times(one + b, two * b);
    }
    for (int i = 0; i < s.p; ++i) numerator.times(one, excess(g, i, two, R(0.0)));
    // Both have the plant's order, and are aligned at their leading coefficients.
    Delta<R, N> plant;
    plant.order = n;
    for (int i = 0; i < n; ++i) plant.a[i] = denominator.c[i + 1];
    for (int i = 0; i <= n; ++i) plant.b[i] = numerator.c[i] * gain;
    return plant;
}

template <class R>
Delta<R> bilinear_plant(const Factors<R>& g, double sample_time) {
    return bilinear_plant<R, -1>(g, sample_time);
}

}  // namespace gaident
