// The arithmetic of the recurrences: a product and a sum with one rounding,
//
//     fma(a, b, c) = a b + c,    fnma(a, b, c) = c - a b.
//
// Written out, and never the compiler's choice (the build forbids contraction), so that every instruction set gives the same bits: the
// processor's own instruction where the source is compiled for one that has it, else the C library's function, which is exact and slow.
// Where c is what the step before has left, it takes part last: one operation from one sample to the next, not two.
//
// A number that has no such operation (a drive's arithmetic: numeric/c30.hpp, numeric/fixed.hpp) multiplies and adds.
#pragma once

#include <cstddef>

#if defined(__FMA__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace gaident {

[[gnu::always_inline]] inline double fma(double a, double b, double c) { return __builtin_fma(a, b, c); }
[[gnu::always_inline]] inline float fma(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
[[gnu::always_inline]] inline double fnma(double a, double b, double c) { return __builtin_fma(-a, b, c); }
[[gnu::always_inline]] inline float fnma(float a, float b, float c) { return __builtin_fmaf(-a, b, c); }

namespace detail {

// The processor's own instructions for a register of so many bytes, with numbers of so many; minus(a, b, c) = c - a b.
// `Isa`: the tag of the instruction set (lanes.hpp).
template <class Isa, std::size_t bytes, std::size_t number>
struct Fused {
    static constexpr bool there = false;
};
#if defined(__FMA__)
#define GAIDENT_FUSED(BYTES, NUMBER, TYPE, PLUS, MINUS)                                                    \
    template <class Isa>                                                                                   \
    struct Fused<Isa, BYTES, NUMBER> {                                                                     \
        static constexpr bool there = true;                                                                \
        [[gnu::always_inline]] static inline TYPE plus(TYPE a, TYPE b, TYPE c) { return PLUS(a, b, c); }   \
        [[gnu::always_inline]] static inline TYPE minus(TYPE a, TYPE b, TYPE c) { return MINUS(a, b, c); } \
    }
GAIDENT_FUSED(16, 8, __m128d, _mm_fmadd_pd, _mm_fnmadd_pd);
GAIDENT_FUSED(16, 4, __m128, _mm_fmadd_ps, _mm_fnmadd_ps);
GAIDENT_FUSED(32, 8, __m256d, _mm256_fmadd_pd, _mm256_fnmadd_pd);
GAIDENT_FUSED(32, 4, __m256, _mm256_fmadd_ps, _mm256_fnmadd_ps);
#if defined(__AVX512F__)
GAIDENT_FUSED(64, 8, __m512d, _mm512_fmadd_pd, _mm512_fnmadd_pd);
GAIDENT_FUSED(64, 4, __m512, _mm512_fmadd_ps, _mm512_fnmadd_ps);
#endif
#undef GAIDENT_FUSED
#elif defined(__aarch64__)
template <class Isa>
struct Fused<Isa, 16, 8> {
    static constexpr bool there = true;
    [[gnu::always_inline]] static inline float64x2_t plus(float64x2_t a, float64x2_t b, float64x2_t c) {
        return vfmaq_f64(c, a, b);
    }
    [[gnu::always_inline]] static inline float64x2_t minus(float64x2_t a, float64x2_t b, float64x2_t c) {
        return vfmsq_f64(c, a, b);
    }
};
template <class Isa>
struct Fused<Isa, 16, 4> {
    static constexpr bool there = true;
    [[gnu::always_inline]] static inline float32x4_t plus(float32x4_t a, float32x4_t b, float32x4_t c) {
        return vfmaq_f32(c, a, b);
    }
    [[gnu::always_inline]] static inline float32x4_t minus(float32x4_t a, float32x4_t b, float32x4_t c) {
        return vfmsq_f32(c, a, b);
    }
};
#endif

}  // namespace detail

}  // namespace gaident
