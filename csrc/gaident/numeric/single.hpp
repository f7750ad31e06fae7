// One candidate in the code of one instruction set: a number like any other, in a type of its own per set, for the reason that lanes have
// one (lanes.hpp). Compiled for a processor with a fused product and sum, it is one instruction and not a call.
#pragma once

#include "arithmetic.hpp"

namespace gaident {

template <class T, class Isa>
struct Single {
    T v;

    Single() = default;
    [[gnu::always_inline]] inline explicit Single(double x) : v(static_cast<T>(x)) {}
    [[gnu::always_inline]] static inline Single all(T x) {
        Single r;
        r.v = x;
        return r;
    }

    [[gnu::always_inline]] friend inline Single operator+(Single a, Single b) { return all(a.v + b.v); }
    [[gnu::always_inline]] friend inline Single operator-(Single a, Single b) { return all(a.v - b.v); }
    [[gnu::always_inline]] friend inline Single operator*(Single a, Single b) { return all(a.v * b.v); }
    [[gnu::always_inline]] friend inline Single operator/(Single a, Single b) { return all(a.v / b.v); }
    [[gnu::always_inline]] friend inline Single operator-(Single a) { return all(-a.v); }
    [[gnu::always_inline]] friend inline Single fma(Single a, Single b, Single c) { return all(gaident::fma(a.v, b.v, c.v)); }
    [[gnu::always_inline]] friend inline Single fnma(Single a, Single b, Single c) { return all(gaident::fnma(a.v, b.v, c.v)); }
    [[gnu::always_inline]] friend inline Single clamp(Single x, Single lo, Single hi) {
        return all(x.v < lo.v ? lo.v : (x.v > hi.v ? hi.v : x.v));
    }
};

}  // namespace gaident
