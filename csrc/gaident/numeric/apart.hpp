// A double whose products and sums are two operations.
// For what a processor without a fused one computes once, before a run,
// and must find the same as the host (target/fixed_scaling.hpp): it needs no library.
#pragma once

#include "arithmetic.hpp"

namespace gaident {

struct Apart {
    double v = 0.0;

    constexpr Apart() = default;
    explicit constexpr Apart(double x) : v(x) {}
    explicit constexpr operator double() const { return v; }

    friend constexpr Apart operator+(Apart a, Apart b) { return Apart(a.v + b.v); }
    friend constexpr Apart operator-(Apart a, Apart b) { return Apart(a.v - b.v); }
    friend constexpr Apart operator-(Apart a) { return Apart(-a.v); }
    friend constexpr Apart operator*(Apart a, Apart b) { return Apart(a.v * b.v); }
    friend constexpr Apart operator/(Apart a, Apart b) { return Apart(a.v / b.v); }
    friend constexpr Apart fma(Apart a, Apart b, Apart c) { return c + a * b; }
    friend constexpr Apart fnma(Apart a, Apart b, Apart c) { return c - a * b; }
    friend constexpr Apart clamp(Apart x, Apart lo, Apart hi) { return Apart(clamp(x.v, lo.v, hi.v)); }
};

static_assert(Arithmetic<Apart>);

}  // namespace gaident
