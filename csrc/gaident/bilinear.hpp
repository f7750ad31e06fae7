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

template <class R>
Delta<R> bilinear_plant(const Factors<R>& g, double sample_time) {
    const Structure s = g.structure;
    const R h = R(0.5 * sample_time), one = R(1.0), two = R(2.0), four = R(4.0);

    R gain = g.gain;
    for (int i = 0; i < s.p; ++i) gain = gain * h;

    Polynomial<R> denominator(one), numerator(one);
    for (int i = 0; i < s.pole_pairs(); ++i) {
        const R e1 = g.pole_pair[i].e1 * h, e0 = (g.pole_pair[i].e0 * h) * h;
        const R lead = (one + e1) + e0;
        denominator.times(one, (two * e1 + four * e0) / lead, (four * e0) / lead);
        gain = gain / lead;
    }
    if (s.single_pole()) {
        const R a = g.pole * h, lead = one + a;
        denominator.times(one, (two * a) / lead);
        gain = gain / lead;
    }
    for (int i = 0; i < s.zero_pairs(); ++i) {
        const R e1 = g.zero_pair[i].e1 * h, e0 = (g.zero_pair[i].e0 * h) * h;
        numerator.times((one + e1) + e0, two * e1 + four * e0, four * e0);
    }
    if (s.single_zero()) {
        const R b = g.zero * h;
        numerator.times(one + b, two * b);
    }
    for (int i = 0; i < s.p; ++i) numerator.times(one, two);
    for (int i = 0; i <= numerator.degree; ++i) numerator.c[i] = numerator.c[i] * gain;
    return make_delta(numerator, denominator);
}

}  // namespace gaident
