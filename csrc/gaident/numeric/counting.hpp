// Numbers that count what is done with them, for the cycle budget (docs/dsp.md): a CountedWord lies in memory, a Counted stands
// in a register.
// Host only: the counts belong to the thread.
#pragma once

#include "arithmetic.hpp"

namespace gaident {

struct Operations {
    long multiplies = 0, adds = 0, divides = 0, loads = 0, stores = 0;  // adds: subtractions, negations and comparisons too
    friend bool operator==(const Operations&, const Operations&) = default;
};

inline thread_local Operations operations;

struct Counted;

struct CountedWord {
    double value = 0.0;

    constexpr CountedWord() = default;
    explicit constexpr CountedWord(double x) : value(x) {}  // a constant: no operation
    CountedWord(const Counted& x);
    explicit operator double() const { return value; }
};

struct Counted {
    double value = 0.0;

    constexpr Counted() = default;
    explicit constexpr Counted(double x) : value(x) {}
    Counted(const CountedWord& w) : value(w.value) { ++operations.loads; }
    explicit operator double() const { return value; }
};

inline CountedWord::CountedWord(const Counted& x) : value(x.value) { ++operations.stores; }

inline Counted operator+(const Counted& a, const Counted& b) {
    ++operations.adds;
    return Counted(a.value + b.value);
}
inline Counted operator-(const Counted& a, const Counted& b) {
    ++operations.adds;
    return Counted(a.value - b.value);
}
inline Counted operator-(const Counted& a) {
    ++operations.adds;
    return Counted(-a.value);
}
inline Counted operator*(const Counted& a, const Counted& b) {
    ++operations.multiplies;
    return Counted(a.value * b.value);
}
// Two operations of a processor that has no third.
inline Counted fma(const Counted& a, const Counted& b, const Counted& c) { return c + a * b; }
inline Counted fnma(const Counted& a, const Counted& b, const Counted& c) { return c - a * b; }
inline Counted operator/(const Counted& a, const Counted& b) {
    ++operations.divides;
    return Counted(a.value / b.value);
}
inline bool operator<(const Counted& a, const Counted& b) {
    ++operations.adds;
    return a.value < b.value;
}
inline bool operator>(const Counted& a, const Counted& b) { return b < a; }
inline Counted clamp(const Counted& x, const Counted& lo, const Counted& hi) { return x < lo ? lo : (hi < x ? hi : x); }

static_assert(Arithmetic<Counted>);

}  // namespace gaident
