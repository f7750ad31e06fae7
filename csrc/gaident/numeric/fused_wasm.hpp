// A product and a sum with one rounding on WebAssembly, which has no such instruction, for two numbers of a register at a time.
//
// Of plain operations that round once each (S. Boldo, G. Melquiond, "Emulation of a FMA and correctly rounded sums: proved algorithms
// using rounding to odd", IEEE Transactions on Computers 57, 2008): the product as p + e exactly, then the three numbers p, e and c are
// added exactly as vh + vl + l, and vl + l is rounded to odd, so that the last addition rounds as if it were the only one.
// This is exact where no part is lost at the ends of the number range; such operands go to the function `other` one by one.
#pragma once

#if defined(__wasm_simd128__)
#include <cstdint>

namespace gaident::detail {

typedef double TwoDoubles __attribute__((vector_size(16)));
typedef std::int64_t TwoWords __attribute__((vector_size(16)));

// a + b = sum + rest exactly.
[[gnu::always_inline]] inline TwoDoubles exact_sum(TwoDoubles a, TwoDoubles b, TwoDoubles& rest) {
    const TwoDoubles sum = a + b, of_b = sum - a;
    rest = (a - (sum - of_b)) + (b - of_b);
    return sum;
}

// a b = product + rest exactly, by halves of 26 bits.
[[gnu::always_inline]] inline TwoDoubles exact_product(TwoDoubles a, TwoDoubles b, TwoDoubles& rest) {
    constexpr double half = 0x1p27 + 1.0;
    const TwoDoubles product = a * b, large_a = half * a, large_b = half * b;
    const TwoDoubles a1 = large_a - (large_a - a), b1 = large_b - (large_b - b), a2 = a - a1, b2 = b - b1;
    rest = ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
    return product;
}

// a + b, and where that is not exact the neighbour whose last bit is 1.
[[gnu::always_inline]] inline TwoDoubles odd_sum(TwoDoubles a, TwoDoubles b) {
    TwoDoubles rest;
    const TwoDoubles sum = exact_sum(a, b, rest);
    const TwoWords bits = reinterpret_cast<TwoWords>(sum);
    // The exact sum is further from 0 than `sum` where the rest has its sign.
    const TwoWords outwards = 1 | ((bits ^ reinterpret_cast<TwoWords>(rest)) < 0);
    const TwoWords to_be_moved = (rest != 0.0) & ((bits & 1) == 0);
    return reinterpret_cast<TwoDoubles>(bits + (outwards & to_be_moved));
}

template <double (*other)(double, double, double)>
[[gnu::always_inline]] inline TwoDoubles fused_of_two(TwoDoubles a, TwoDoubles b, TwoDoubles c) {
    // Then no part above overflows, and none is below the least normal number.
    constexpr double factor = 0x1p120, least = 0x1p-900, most = 0x1p900;
    const auto size = [](TwoDoubles x) {
        return reinterpret_cast<TwoDoubles>(reinterpret_cast<TwoWords>(x) & 0x7FFF'FFFF'FFFF'FFFF);
    };
    TwoDoubles e, l, vl;
    const TwoDoubles p = exact_product(a, b, e), of_c = size(c);
    const TwoWords factors = (size(a) < factor) & (size(b) < factor), addend = (of_c < most) & ((of_c > least) | (c == 0.0));
    const TwoDoubles th = exact_sum(c, e, l), vh = exact_sum(p, th, vl), sum = vh + odd_sum(l, vl);
    if (__builtin_wasm_all_true_i64x2(factors & addend & (size(p) > least))) [[likely]]
        return sum;
    // A factor of 0, as a held plant has one in every sample: its product is exact.
    const TwoWords zero = (a == 0.0) | (b == 0.0);
    if (__builtin_wasm_all_true_i64x2(factors & addend & ((size(p) > least) | zero))) return zero ? p + c : sum;
    return TwoDoubles{other(a[0], b[0], c[0]), other(a[1], b[1], c[1])};
}

// Of floats in double, where their product is exact; with denormals flushed as an instruction does it, after rounding to 24 bits.
inline float fused_of_floats(float a, float b, float c, bool flushed) {
    constexpr float least = 0x1p-126F;
    const auto flush = [flushed](float x) { return flushed && __builtin_fabsf(x) < least ? __builtin_copysignf(0.0F, x) : x; };
    a = flush(a), b = flush(b), c = flush(c);
    const double product = static_cast<double>(a) * static_cast<double>(b), added = c;
    const double sum = product + added, size = __builtin_fabs(sum);
    if (!(size < 0x1p1000)) return static_cast<float>(sum);  // no number, or infinite
    const double odd = odd_sum(TwoDoubles{product, product}, TwoDoubles{added, added})[0];
    if (flushed && __builtin_fabs(odd) < 0x1p-126 - 0x1p-151) return __builtin_copysignf(0.0F, static_cast<float>(odd));
    return static_cast<float>(odd);
}

}  // namespace gaident::detail
#endif
