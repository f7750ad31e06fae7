// The float of the paper's processor, the TMS320C30 (TMS320C3x User's Guide, chapter 5): no rounding, no denormals, no
// infinities.
//
//     word, 32 bits       e (8, two's complement) | s | f (23)       value 01.f * 2^e or, s = 1, 10.f * 2^e; e = -128 is 0
//     register, 40 bits   the same with f of 31 bits
//
// Every addition and subtraction works on registers: the mantissa of the smaller exponent is shifted right, what falls out is
// dropped, the sum is normalised.
// A multiplication cuts both operands to words first and keeps 32 bits of the product.
// A store cuts a register to a word.
// All of this rounds towards minus infinity.
// Beyond the range a result takes the largest number of its sign, below it 0.
// The processor has no division: 1/v is five steps of Newton's x (2 - v x) from x = 2^(-e-1).
#pragma once

#include "arithmetic.hpp"
#include "bit_cast.hpp"

#include <bit>
#include <cstdint>

namespace gaident {

struct C30;

// As it lies in memory.
struct C30Word {
    std::uint32_t bits = 0x80000000U;

    constexpr C30Word() = default;
    constexpr C30Word(C30 x);              // a store
    explicit constexpr C30Word(double x);  // rounded to nearest, as an assembler would
    static constexpr C30Word of_bits(std::uint32_t bits) {
        C30Word w;
        w.bits = bits;
        return w;
    }
    explicit constexpr operator double() const;
    friend constexpr bool operator==(C30Word, C30Word) = default;  // each number has one pattern
};

// As it stands in a register: mantissa * 2^(exponent - 31), mantissa in [2^31, 2^32) or [-2^32, -2^31), or 0.
struct C30 {
    std::int64_t mantissa = 0;
    int exponent = -128;

    constexpr C30() = default;
    explicit constexpr C30(double x) : C30(C30Word(x)) {}
    constexpr C30(C30Word w) {  // a load
        const int e = static_cast<std::int8_t>(w.bits >> 24);
        if (e == -128) return;
        exponent = e;
        const std::int64_t f = static_cast<std::int64_t>(w.bits & 0x7FFFFFU) << 8;
        mantissa = (w.bits & 0x800000U) != 0 ? f - (std::int64_t{1} << 32) : f + (std::int64_t{1} << 31);
    }

    // Any mantissa below 2^62 in size.
    static constexpr C30 normal(std::int64_t m, int e) {
        C30 x;
        if (m == 0) return x;
        const int excess = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(m < 0 ? ~m : m))) - 32;
        m = excess > 0 ? m >> excess : m * (std::int64_t{1} << -excess);
        e += excess;
        if (e < -127) return x;
        x.mantissa = e <= 127 ? m : (m < 0 ? -(std::int64_t{1} << 32) : (std::int64_t{1} << 32) - 1);
        x.exponent = e <= 127 ? e : 127;
        return x;
    }

    explicit constexpr operator double() const {
        const auto bits = static_cast<std::uint64_t>(1023 + exponent - 31) << 52;
        return static_cast<double>(mantissa) * bit_cast<double>(bits);
    }
};

constexpr C30Word::C30Word(C30 x) {
    if (x.mantissa == 0) return;
    bits = static_cast<std::uint32_t>(x.exponent) << 24 | (static_cast<std::uint32_t>(x.mantissa >> 8) & 0x7FFFFFU) |
           (x.mantissa < 0 ? 0x800000U : 0U);
}

constexpr C30Word::C30Word(double x) {
    const auto b = bit_cast<std::uint64_t>(x);
    const int e = static_cast<int>(b >> 52 & 0x7FF);
    if (e == 0) return;  // 0, and what is far below the smallest word
    const auto size = static_cast<std::int64_t>((b & 0xFFFFFFFFFFFFFULL) | 1ULL << 52);
    const std::int64_t m = x < 0.0 ? -size : size;
    *this = C30::normal(((m + (1 << 28)) >> 29) * 256, e - 1023);
}

constexpr C30Word::operator double() const { return static_cast<double>(C30(*this)); }

namespace detail {

constexpr C30 c30_sum(C30 a, C30 b, int sign) {
    const int e = a.exponent > b.exponent ? a.exponent : b.exponent;
    const auto aligned = [e](C30 x) { return x.mantissa >> (e - x.exponent < 62 ? e - x.exponent : 62); };
    return C30::normal(aligned(a) + sign * aligned(b), e);
}

}  // namespace detail

constexpr C30 operator+(C30 a, C30 b) { return detail::c30_sum(a, b, 1); }
constexpr C30 operator-(C30 a, C30 b) { return detail::c30_sum(a, b, -1); }
constexpr C30 operator-(C30 a) { return C30() - a; }
constexpr C30 operator*(C30 a, C30 b) {
    return C30::normal((a.mantissa >> 8) * (b.mantissa >> 8) >> 15, a.exponent + b.exponent);
}
// The product keeps its register's width: MPYF3, then ADDF3 or SUBF3.
constexpr C30 fma(C30 a, C30 b, C30 c) { return c + a * b; }
constexpr C30 fnma(C30 a, C30 b, C30 c) { return c - a * b; }
constexpr C30 operator/(C30 a, C30 b) {
    const bool negative = b.mantissa < 0;
    const C30 v = negative ? -b : b, two = C30::normal(1, 32);
    C30 x = C30::normal(1, 30 - v.exponent);
    for (int i = 0; i < 5; ++i) x = x * (two - v * x);
    return a * (negative ? -x : x);
}
constexpr bool operator<(C30 a, C30 b) { return (a - b).mantissa < 0; }
constexpr C30 clamp(C30 x, C30 lo, C30 hi) { return x < lo ? lo : (hi < x ? hi : x); }

static_assert(Arithmetic<C30>);

}  // namespace gaident
