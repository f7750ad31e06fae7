// The arithmetic of the recurrences: a product and a sum with one rounding,
//
//     fma(a, b, c) = a b + c,    fnma(a, b, c) = c - a b.
//
// Written out, and never the compiler's choice (the build forbids contraction), so that every instruction set gives the same bits: the
// processor's own instruction where the source is compiled for one that has it, else the C library's function, which takes that
// instruction where the processor has it, and is exact and slow where not.
// WebAssembly has no such instruction: there the operation is made of others (fused_wasm.hpp).
// That of MinGW rounds twice: there the instruction is called, and a processor without it (before 2013) has other bits.
// Where c is what the step before has left, it takes part last: one operation from one sample to the next, not two.
//
// A number that has no such operation (a drive's arithmetic: numeric/c30.hpp, numeric/fixed.hpp) multiplies and adds.
#pragma once

#include <cstddef>

#if defined(__FMA__)
#include <immintrin.h>
#elif defined(__SSE2__) || defined(__wasm_simd128__)
#include "bit_cast.hpp"
#include "denormals.hpp"
#include "fused_wasm.hpp"

#include <cstdint>
#include <limits>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace gaident {

namespace detail {

#if defined(__MINGW32__) && defined(__x86_64__) && !defined(__FMA__)
inline const bool processor_fuses = __builtin_cpu_supports("fma") != 0;
[[gnu::target("fma"), gnu::noinline]] inline double instruction(double a, double b, double c) { return __builtin_fma(a, b, c); }
[[gnu::target("fma"), gnu::noinline]] inline float instruction(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
[[gnu::always_inline]] inline double fused(double a, double b, double c) {
    return processor_fuses ? instruction(a, b, c) : __builtin_fma(a, b, c);
}
[[gnu::always_inline]] inline float fused(float a, float b, float c) {
    return processor_fuses ? instruction(a, b, c) : __builtin_fmaf(a, b, c);
}
#elif (defined(__SSE2__) && !defined(__FMA__)) || defined(__wasm_simd128__)
// The C library's function without the instruction splits its operands and adds up what is lost.
// Where denormals are flushed (FlushDenormals) some of these parts are, and from 1e-291 down its results are wrong;
// the instruction flushes operands and result and nothing in between.
// So the parts are computed with denormals, and operands and result are flushed here.
// (The function for floats computes in double, whose parts are no denormals.)
[[gnu::noinline]] inline double fma_between_flushes(double a, double b, double c) {
    constexpr double least = std::numeric_limits<double>::min();
    const unsigned before = FlushDenormals::control();
    const bool flushed = (before & FlushDenormals::flush) != 0;
    const auto flush = [flushed](double& x) {  // by its bits: whatever the control word says
        const bool small = (bit_cast<std::uint64_t>(x) & 0x7ff0'0000'0000'0000) == 0;
        if (flushed && small) x = __builtin_copysign(0.0, x);
    };
    const auto call = [](double x, double y, double z) {
#if defined(__SSE2__)
        asm volatile("" : "+x"(x), "+x"(y), "+x"(z));  // the call stays between the two settings of the control word
        double r = __builtin_fma(x, y, z);
        asm volatile("" : "+x"(r));
        return r;
#else
        return __builtin_fma(x, y, z);
#endif
    };
    flush(a), flush(b), flush(c);
    FlushDenormals::set_control(before & ~FlushDenormals::flush);
    double r = call(a, b, c);
    // The instruction flushes what is below the least normal number after rounding to 53 bits.
    // A denormal has fewer, and may have been rounded up to that number: seen at twice the size.
    // Then the lesser factor is far from the largest number.
    if (flushed && __builtin_fabs(r) == least) {
        const bool first = __builtin_fabs(a) < __builtin_fabs(b);
        if (__builtin_fabs(call(first ? 2.0 * a : a, first ? b : 2.0 * b, 2.0 * c)) < 2.0 * least) r = __builtin_copysign(0.0, r);
    }
    FlushDenormals::set_control(before);
    flush(r);
    return r;
}

#if defined(__wasm_simd128__)
[[gnu::always_inline]] inline double fused(double a, double b, double c) {
    return fused_of_two<fma_between_flushes>(TwoDoubles{a, a}, TwoDoubles{b, b}, TwoDoubles{c, c})[0];
}
[[gnu::always_inline]] inline float fused(float a, float b, float c) {
    return fused_of_floats(a, b, c, (FlushDenormals::control() & FlushDenormals::flush) != 0);
}
#else
// Whether the library goes without the instruction is asked of the library itself, by two products that then go wrong.
inline bool library_goes_without() {
    const auto right = [](double x, double y, double z, double expected) {
        volatile double in[] = {x, y, z}, out;
        const FlushDenormals flush;
        out = __builtin_fma(in[0], in[1], in[2]);
        return out == expected;
    };
    return !right(-0x1.2245bd5fbb686p+2, 0x1.0561d8057935cp-998, -0x1.78833635915bdp-977, -0x1.78835b4192c9ep-977) ||
           !right(0x1p-1030, 0x1p+1000, 0.0, 0.0);
}
inline const bool without_instruction = library_goes_without();

[[gnu::always_inline]] inline double fused(double a, double b, double c) {
    return without_instruction ? fma_between_flushes(a, b, c) : __builtin_fma(a, b, c);
}
#endif
#else
[[gnu::always_inline]] inline double fused(double a, double b, double c) { return __builtin_fma(a, b, c); }
#endif
#if !defined(__wasm_simd128__) && (!(defined(__MINGW32__) && defined(__x86_64__)) || defined(__FMA__))
[[gnu::always_inline]] inline float fused(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
#endif

}  // namespace detail

[[gnu::always_inline]] inline double fma(double a, double b, double c) { return detail::fused(a, b, c); }
[[gnu::always_inline]] inline float fma(float a, float b, float c) { return detail::fused(a, b, c); }
[[gnu::always_inline]] inline double fnma(double a, double b, double c) { return detail::fused(-a, b, c); }
[[gnu::always_inline]] inline float fnma(float a, float b, float c) { return detail::fused(-a, b, c); }

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
#elif defined(__wasm_simd128__)
template <class Isa>
struct Fused<Isa, 16, 8> {
    static constexpr bool there = true;
    // Not inlined: some forty operations.
    [[gnu::noinline]] static TwoDoubles plus(TwoDoubles a, TwoDoubles b, TwoDoubles c) {
        return fused_of_two<fma_between_flushes>(a, b, c);
    }
    [[gnu::always_inline]] static inline TwoDoubles minus(TwoDoubles a, TwoDoubles b, TwoDoubles c) { return plus(-a, b, c); }
};
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
