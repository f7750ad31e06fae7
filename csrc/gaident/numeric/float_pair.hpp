// A number as the unevaluated sum of two floats, hi + lo with |lo| at most half a last digit of hi: 48 bits from 32-bit
// arithmetic, for what 24 bits cannot represent (delta.hpp: float_suffices).
// Sums and products without error after Knuth and Dekker (T. J. Dekker, A floating-point technique for extending the available
// precision, Numer. Math. 18, 1971).
#pragma once

#include "arithmetic.hpp"

#include <cmath>

namespace gaident {

struct FloatPair {
    float hi = 0.0F, lo = 0.0F;

    FloatPair() = default;
    explicit FloatPair(double x) : hi(static_cast<float>(x)) {
        if (std::isfinite(hi)) lo = static_cast<float>(x - static_cast<double>(hi));
    }
    explicit operator double() const { return static_cast<double>(hi) + static_cast<double>(lo); }

    friend FloatPair operator+(FloatPair a, FloatPair b) {
        const float sum = a.hi + b.hi, of_b = sum - a.hi;
        const float error = (a.hi - (sum - of_b)) + (b.hi - of_b);
        return normal(sum, error + (a.lo + b.lo));
    }
    friend FloatPair operator*(FloatPair a, FloatPair b) {
        const float product = a.hi * b.hi, error = gaident::fma(a.hi, b.hi, -product);
        return normal(product, error + (a.hi * b.lo + a.lo * b.hi));
    }
    friend FloatPair fma(FloatPair a, FloatPair b, FloatPair c) { return c + a * b; }
    friend FloatPair fnma(FloatPair a, FloatPair b, FloatPair c) { return c - a * b; }
    friend FloatPair operator/(FloatPair a, FloatPair b) {
        const FloatPair first = normal(a.hi / b.hi, 0.0F), rest = a - b * first;
        return normal(first.hi, rest.hi / b.hi);
    }
    friend FloatPair operator-(FloatPair a) { return FloatPair(-a.hi, -a.lo); }
    friend FloatPair operator-(FloatPair a, FloatPair b) { return a + -b; }
    friend bool operator<(FloatPair a, FloatPair b) { return a.hi < b.hi || (a.hi == b.hi && a.lo < b.lo); }
    friend FloatPair clamp(FloatPair x, FloatPair lo, FloatPair hi) { return x < lo ? lo : (hi < x ? hi : x); }

private:
    FloatPair(float h, float l) : hi(h), lo(l) {}
    static FloatPair normal(float sum, float small) {
        const float hi = sum + small;
        return {hi, small - (hi - sum)};
    }
};

static_assert(Arithmetic<FloatPair>);

}  // namespace gaident
