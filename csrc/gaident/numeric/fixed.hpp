// Fixed point: 32-bit words, 64-bit accumulators, and no float at all.
//
// A word w with binary point f stands for w 2^-f. There are two kinds:
//
// FixedNumber   a parameter, coefficient or cost. Its point follows its value, so that 30 bits stand behind the sign.
//               K, the roots and the polynomial's coefficients lie many decades apart.
//               Each operation rounds to nearest, halves up.
//               A quotient is cut towards zero first, within one unit of its last bit.
// FixedSignal   a velocity or a state of the recurrence. Its point is chosen before the run (fixed_scaling.hpp) and stays.
//
// In a recurrence signals are summed in 64 bits with 16 more bits behind the point, products moved to that point rounded to
// nearest; the word that is stored is rounded once.
// What a word cannot represent takes its end, and whatever is computed from it says so: `saturated`.
#pragma once

#include "arithmetic.hpp"
#include "bit_cast.hpp"

#include <bit>
#include <cstdint>
#include <limits>

namespace gaident {

namespace detail {

// value * 2^-shift, rounded to nearest; halves up
constexpr std::int64_t shifted_down(std::int64_t value, int shift) {
    if (shift == 0) return value;
    return shift > 62 ? 0 : ((value >> (shift - 1)) + 1) >> 1;
}
constexpr int width_of(std::int64_t v) { return static_cast<int>(std::bit_width(static_cast<std::uint64_t>(v < 0 ? -v : v))); }

}  // namespace detail

struct FixedNumber {
    std::int32_t word = 0;  // 0 or 2^30 .. 2^31 - 1 in size
    std::int32_t point = 0;

    constexpr FixedNumber() = default;
    explicit constexpr FixedNumber(double x) {
        const auto b = bit_cast<std::uint64_t>(x);
        const int e = static_cast<int>(b >> 52 & 0x7FF);
        if (e == 0) return;
        const auto size = static_cast<std::int64_t>((b & 0xFFFFFFFFFFFFFULL) | 1ULL << 52);
        *this = normal(x < 0.0 ? -size : size, 1075 - e);
    }
    // Any value up to 2^62 in size. Not inlined: it stands in a drive's flash once.
    [[gnu::noinline]] static constexpr FixedNumber normal(std::int64_t value, int point) {
        FixedNumber x;
        if (value == 0) return x;
        int excess = detail::width_of(value) - 31;
        value = excess > 0 ? detail::shifted_down(value, excess) : value * (std::int64_t{1} << -excess);
        if (detail::width_of(value) > 31) {  // rounded up to 2^31
            value /= 2;
            ++excess;
        }
        x.word = static_cast<std::int32_t>(value);
        x.point = point - excess;
        return x;
    }
    // What no sum of squared errors reaches; for diverged candidates.
    static constexpr FixedNumber largest() {
        FixedNumber x;
        x.word = std::numeric_limits<std::int32_t>::max();
        x.point = -900;
        return x;
    }
    explicit constexpr operator double() const {
        return static_cast<double>(word) * bit_cast<double>(static_cast<std::uint64_t>(1023 - point) << 52);
    }
};

constexpr FixedNumber operator*(FixedNumber a, FixedNumber b) {
    return FixedNumber::normal(std::int64_t{a.word} * b.word, a.point + b.point);
}
[[gnu::noinline]] constexpr FixedNumber operator+(FixedNumber a, FixedNumber b) {
    if (a.word == 0) return b;
    if (b.word == 0) return a;
    const FixedNumber &large = a.point <= b.point ? a : b, &small = a.point <= b.point ? b : a;
    constexpr std::int64_t up = std::int64_t{1} << 30;
    return FixedNumber::normal(large.word * up + detail::shifted_down(small.word * up, small.point - large.point),
                               large.point + 30);
}
constexpr FixedNumber operator-(FixedNumber a) {
    a.word = -a.word;
    return a;
}
constexpr FixedNumber operator-(FixedNumber a, FixedNumber b) { return a + -b; }
constexpr FixedNumber fma(FixedNumber a, FixedNumber b, FixedNumber c) { return c + a * b; }
constexpr FixedNumber fnma(FixedNumber a, FixedNumber b, FixedNumber c) { return c - a * b; }
constexpr FixedNumber operator/(FixedNumber a, FixedNumber b) {
    if (b.word == 0) return a.word < 0 ? -FixedNumber::largest() : FixedNumber::largest();
    return FixedNumber::normal(a.word * (std::int64_t{1} << 31) / b.word, a.point + 31 - b.point);
}
constexpr bool operator<(FixedNumber a, FixedNumber b) { return (a - b).word < 0; }
constexpr FixedNumber clamp(FixedNumber x, FixedNumber lo, FixedNumber hi) { return x < lo ? lo : (hi < x ? hi : x); }

static_assert(Arithmetic<FixedNumber>);

struct FixedSum;

struct FixedSignal {
    std::int32_t word = 0;
    std::int16_t point = 0;
    bool saturated = false;

    constexpr FixedSignal() = default;
    constexpr FixedSignal(const FixedSum& sum);  // a store
    constexpr FixedSignal(std::int64_t value, int at, bool was_saturated) : point(static_cast<std::int16_t>(at)) {
        constexpr std::int64_t lo = std::numeric_limits<std::int32_t>::min(), hi = std::numeric_limits<std::int32_t>::max();
        saturated = was_saturated || value < lo || value > hi;
        word = static_cast<std::int32_t>(value < lo ? lo : (value > hi ? hi : value));
    }
    // x with its binary point at `at`.
    static constexpr FixedSignal of(double x, int at) {
        const FixedNumber n(x);
        const int down = n.point - at;
        if (down >= 0) return {detail::shifted_down(n.word, down), at, false};
        constexpr std::int64_t beyond = std::int64_t{1} << 32;
        return {down < -31 ? (n.word < 0 ? -beyond : (n.word > 0 ? beyond : 0)) : n.word * (std::int64_t{1} << -down), at, false};
    }
    explicit constexpr operator double() const { return static_cast<double>(FixedNumber::normal(word, point)); }
};

struct FixedProduct {
    std::int64_t value;
    int point;
    bool saturated;
};

struct FixedSum {
    static constexpr int guard = 16;
    std::int64_t value = 0;
    int point = 0;
    bool saturated = false;

    constexpr FixedSum(const FixedSignal& x)
        : value(x.word * (std::int64_t{1} << guard)), point(x.point + guard), saturated(x.saturated) {}

    constexpr void add(std::int64_t term, int term_point, bool was_saturated) {
        constexpr std::int64_t most = std::int64_t{1} << 60;  // so that no sum of four overflows
        const int down = term_point - point;
        if (down >= 0) term = detail::shifted_down(term, down);
        else term = detail::width_of(term) - down <= 60 ? term * (std::int64_t{1} << -down) : most + 1;
        const bool fits = term <= most && term >= -most;
        saturated = saturated || was_saturated || !fits;
        if (fits) value += term;
    }
};

constexpr FixedSignal::FixedSignal(const FixedSum& s)
    : FixedSignal(detail::shifted_down(s.value, FixedSum::guard), s.point - FixedSum::guard, s.saturated) {}

constexpr FixedSum operator+(FixedSum a, FixedSignal b) {
    a.add(b.word, b.point, b.saturated);
    return a;
}
constexpr FixedSum operator+(FixedSum a, FixedProduct b) {
    a.add(b.value, b.point, b.saturated);
    return a;
}
constexpr FixedSum operator-(FixedSum a, FixedProduct b) {
    a.add(-b.value, b.point, b.saturated);
    return a;
}
constexpr FixedSignal operator-(FixedSignal a, FixedSignal b) {  // of one binary point
    return {std::int64_t{a.word} - b.word, a.point, a.saturated || b.saturated};
}
constexpr FixedProduct operator*(FixedNumber a, FixedSignal b) {
    return {std::int64_t{a.word} * b.word, a.point + b.point, b.saturated};
}
constexpr FixedProduct operator*(FixedSignal a, FixedSignal b) {
    return {std::int64_t{a.word} * b.word, a.point + b.point, a.saturated || b.saturated};
}

// A product that joins a sum is rounded to the sum's point, 16 bits behind the word's.
constexpr FixedSum fma(FixedNumber a, FixedSignal b, FixedSum c) { return c + a * b; }
constexpr FixedSum fnma(FixedNumber a, FixedSignal b, FixedSum c) { return c - a * b; }

// Of squared errors: 16 bits of each square are dropped, so that 2^16 of the largest fit.
struct FixedErrorSum {
    static constexpr int dropped = 16;
    std::int64_t value = 0;
    int point = 0;
    bool saturated = false;

    friend constexpr FixedErrorSum operator+(FixedErrorSum a, FixedProduct square) {
        a.saturated = a.saturated || square.saturated || a.value > std::int64_t{1} << 61;
        if (!a.saturated) a.value += square.value >> dropped;
        return a;
    }
    friend constexpr FixedErrorSum fma(FixedSignal a, FixedSignal b, FixedErrorSum c) { return c + a * b; }
};

}  // namespace gaident
