// Elementary functions for the sample loop, the same lines for double and for Lanes, so that both give the same bits on every machine:
// comparisons as selections, rounding, exponential and sine by polynomials (no libm), the square root by the processor (correctly rounded).
#pragma once

#include "bit_cast.hpp"
#include "lanes.hpp"
#include "single.hpp"

#include <cstdint>

namespace gaident {

// How many candidates a number stands for, how many registers it takes, and how they lie in memory.
template <class R>
struct Pack;

template <>
struct Pack<double> {
    static constexpr int width = 1, registers = 1;
    [[gnu::always_inline]] static inline double load(const double* p) { return *p; }
    [[gnu::always_inline]] static inline double gather(auto&& of) { return of(std::size_t{0}); }
    [[gnu::always_inline]] static inline void store(double x, double* p) { *p = x; }
};

template <int W, class Isa>
struct Pack<Lanes<double, W, Isa>> {
    static constexpr int width = W, registers = Lanes<double, W, Isa>::registers;
    [[gnu::always_inline]] static inline Lanes<double, W, Isa> load(const double* p) { return Lanes<double, W, Isa>::load(p); }
    // of(lane) for each
    [[gnu::always_inline]] static inline Lanes<double, W, Isa> gather(auto&& of) { return Lanes<double, W, Isa>::gather(of); }
    [[gnu::always_inline]] static inline void store(const Lanes<double, W, Isa>& x, double* p) { x.store(p); }
};

template <class Isa>
struct Pack<Single<double, Isa>> {
    static constexpr int width = 1, registers = 1;
    [[gnu::always_inline]] static inline Single<double, Isa> load(const double* p) { return Single<double, Isa>::all(*p); }
    [[gnu::always_inline]] static inline Single<double, Isa> gather(auto&& of) {
        return Single<double, Isa>::all(of(std::size_t{0}));
    }
    [[gnu::always_inline]] static inline void store(Single<double, Isa> x, double* p) { *p = x.v; }
};

// x where a > b, else y
[[gnu::always_inline]] inline double greater(double a, double b, double x, double y) { return a > b ? x : y; }

template <class T, int W, class Isa>
[[gnu::always_inline]] inline Lanes<T, W, Isa> greater(const Lanes<T, W, Isa>& a, const Lanes<T, W, Isa>& b,
                                                       const Lanes<T, W, Isa>& x, const Lanes<T, W, Isa>& y) {
    using L = Lanes<T, W, Isa>;
    L r;
#pragma GCC unroll 8
    for (int i = 0; i < L::registers; ++i) r.v[i] = typename L::Register(a.v[i] > b.v[i] ? x.v[i] : y.v[i]);
    return r;
}

template <class Isa>
[[gnu::always_inline]] inline Single<double, Isa> greater(Single<double, Isa> a, Single<double, Isa> b, Single<double, Isa> x,
                                                          Single<double, Isa> y) {
    return a.v > b.v ? x : y;
}

// A vector of words in `bytes` bytes.
template <std::size_t bytes>
struct Words {
    typedef long long Type __attribute__((vector_size(bytes)));
};

// Whether the words of a comparison's result are all true. Its halves are joined until one word is left.
template <std::size_t bytes>
[[gnu::always_inline]] inline bool all_true(const typename Words<bytes>::Type& words) {
    typename Words<bytes / 2>::Type half[2];
    __builtin_memcpy(half, &words, sizeof half);
    if constexpr (bytes == 2 * sizeof(long long)) return (half[0] & half[1])[0] != 0;
    else return all_true<bytes / 2>(half[0] & half[1]);
}

// Whether a > b everywhere: for short cuts that change no result.
[[gnu::always_inline]] inline bool all_above(double a, double b) { return a > b; }
template <class Isa>
[[gnu::always_inline]] inline bool all_above(Single<double, Isa> a, Single<double, Isa> b) {
    return a.v > b.v;
}

template <int W, class Isa>
[[gnu::always_inline]] inline bool all_above(const Lanes<double, W, Isa>& a, const Lanes<double, W, Isa>& b) {
    using L = Lanes<double, W, Isa>;
    using Mask = typename Words<Isa::register_bytes>::Type;
    Mask all = Mask(a.v[0] > b.v[0]);
#pragma GCC unroll 8
    for (int i = 1; i < L::registers; ++i) all &= Mask(a.v[i] > b.v[i]);
    return all_true<Isa::register_bytes>(all);
}

template <class R>
[[gnu::always_inline]] inline R minimum(R a, R b) {
    return greater(a, b, b, a);
}
template <class R>
[[gnu::always_inline]] inline R maximum(R a, R b) {
    return greater(a, b, a, b);
}
[[gnu::always_inline]] inline double absolute(double x) { return __builtin_fabs(x); }
template <class Isa>
[[gnu::always_inline]] inline Single<double, Isa> absolute(Single<double, Isa> x) {
    return Single<double, Isa>::all(__builtin_fabs(x.v));
}

template <int W, class Isa>
[[gnu::always_inline]] inline Lanes<double, W, Isa> absolute(const Lanes<double, W, Isa>& x) {
    using L = Lanes<double, W, Isa>;
    typedef unsigned long long Bits __attribute__((vector_size(Isa::register_bytes)));
    L r;
#pragma GCC unroll 8
    for (int i = 0; i < L::registers; ++i) r.v[i] = typename L::Register(Bits(x.v[i]) & 0x7fffffffffffffffULL);
    return r;
}

[[gnu::always_inline]] inline double square_root(double x) { return __builtin_sqrt(x); }
template <class Isa>
[[gnu::always_inline]] inline Single<double, Isa> square_root(Single<double, Isa> x) {
    return Single<double, Isa>::all(__builtin_sqrt(x.v));
}

template <int W, class Isa>
[[gnu::always_inline]] inline Lanes<double, W, Isa> square_root(const Lanes<double, W, Isa>& x) {
    alignas(64) double v[W];
    x.store(v);
    for (int i = 0; i < W; ++i) v[i] = __builtin_sqrt(v[i]);
    return Lanes<double, W, Isa>::load(v);
}

namespace detail {

inline constexpr double round_magic = 6755399441055744.0;  // 1.5 * 2^52: adding it leaves the nearest integer in the low bits

// x * 2^k, where `shifted` is round_magic + k; no overflow is looked after
[[gnu::always_inline]] inline double scaled(double x, double shifted) {
    return bit_cast<double>(bit_cast<std::uint64_t>(x) + (bit_cast<std::uint64_t>(shifted) << 52U));
}

template <class Isa>
[[gnu::always_inline]] inline Single<double, Isa> scaled(Single<double, Isa> x, Single<double, Isa> shifted) {
    return Single<double, Isa>::all(scaled(x.v, shifted.v));
}

template <int W, class Isa>
[[gnu::always_inline]] inline Lanes<double, W, Isa> scaled(const Lanes<double, W, Isa>& x, const Lanes<double, W, Isa>& shifted) {
    using L = Lanes<double, W, Isa>;
    typedef unsigned long long Bits __attribute__((vector_size(Isa::register_bytes)));
    L r;
#pragma GCC unroll 8
    for (int i = 0; i < L::registers; ++i) r.v[i] = typename L::Register(Bits(x.v[i]) + (Bits(shifted.v[i]) << 52));
    return r;
}

}  // namespace detail

// The nearest integer, ties to even, for abs(x) < 2^51.
template <class R>
[[gnu::always_inline]] inline R nearest(R x) {
    return (x + R(detail::round_magic)) - R(detail::round_magic);
}

// e^-y for y >= 0; 1e-11 relative, 1e-304 where y > 700.
template <class R>
[[gnu::always_inline]] inline R exp_of_minus(R y) {
    const R t = minimum(y, R(700.0));
    const R shifted = fnma(t, R(1.4426950408889634), R(detail::round_magic));
    const R r = fma(R(detail::round_magic) - shifted, R(0.69314718055994531), -t);
    // Taylor series to r^9, abs(r) < 0.347, in pairs so that the chain is short
    const R r2 = r * r, r4 = r2 * r2;
    const R p01 = R(1.0) + r, p23 = fma(r, R(1.0 / 6), R(1.0 / 2)), p45 = fma(r, R(1.0 / 120), R(1.0 / 24));
    const R p67 = fma(r, R(1.0 / 5040), R(1.0 / 720)), p89 = fma(r, R(1.0 / 362880), R(1.0 / 40320));
    return detail::scaled(fma(r4, fma(r4, p89, fma(r2, p67, p45)), fma(r2, p23, p01)), shifted);
}

// sin x; 1e-13 absolute for abs(x) < 100, beyond that the rounding of x itself.
template <class R>
[[gnu::always_inline]] inline R sine(R x) {
    const R turns = x * R(0.15915494309189535);
    const R r = turns - nearest(turns);
    // sin(2 pi r) = sin(2 pi (1/2 - r)): from half a turn to a quarter
    const R half = greater(r, R(0.0), R(0.5), R(-0.5));
    const R t = greater(absolute(r), R(0.25), half - r, r);
    const R x1 = t * R(6.283185307179586476925), x2 = x1 * x1, x4 = x2 * x2, x8 = x4 * x4;
    const R a = fnma(x2, R(1.0 / 6), R(1.0)), b = fnma(x2, R(1.0 / 5040), R(1.0 / 120));
    const R c = fnma(x2, R(1.0 / 39916800), R(1.0 / 362880)), d = fnma(x2, R(1.0 / 1307674368000), R(1.0 / 6227020800));
    const R e = fnma(x2, R(1.0 / 121645100408832000), R(1.0 / 355687428096000));
    return x1 * fma(x8, fma(x8, e, fma(x4, d, c)), fma(x4, b, a));
}

template <class R>
[[gnu::always_inline]] inline R cosine(R x) {
    return sine(x + R(1.5707963267948966));
}

}  // namespace gaident
