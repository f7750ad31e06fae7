// A plant as its factors (equation 2):
//
//     G(s) = K * prod_zeros (s + b) / prod_poles (s + a),      p poles more than zeros, q zeros
//
// gathered in second-order factors s^2 + e1 s + e0, which contain a conjugate pair and two real roots alike, and at most one
// first-order factor on each side. p + q poles make (p+q)/2 pairs and, if odd, one single; q zeros likewise.
#pragma once

#include "../numeric/arithmetic.hpp"

namespace gaident {

inline constexpr int max_plant_order = 14;  // p + q with both up to 7
inline constexpr int max_pairs = max_plant_order / 2;

struct Structure {
    int p = 0, q = 0;
    int poles() const { return p + q; }
    int pole_pairs() const { return (p + q) / 2; }
    bool single_pole() const { return (p + q) % 2 != 0; }
    int zero_pairs() const { return q / 2; }
    bool single_zero() const { return q % 2 != 0; }
    int parameters() const { return 1 + p + 2 * q; }
    friend bool operator==(const Structure&, const Structure&) = default;
};

template <class R>
struct Pair {
    R e1, e0;  // s^2 + e1 s + e0
};

// How many factors of each kind a product takes in.
struct Counts {
    int order = 0, p = 0, pole_pairs = 0, zero_pairs = 0;
    bool single_pole = false, single_zero = false;

    Counts() = default;
    explicit Counts(Structure s)
        : order(s.poles()),
          p(s.p),
          pole_pairs(s.pole_pairs()),
          zero_pairs(s.zero_pairs()),
          single_pole(s.single_pole()),
          single_zero(s.single_zero()) {}

    // Room for both.
    void cover(const Counts& c) {
        const auto larger = [](int a, int b) { return a < b ? b : a; };
        order = larger(order, c.order);
        p = larger(p, c.p);
        pole_pairs = larger(pole_pairs, c.pole_pairs);
        zero_pairs = larger(zero_pairs, c.zero_pairs);
        single_pole = single_pole || c.single_pole;
        single_zero = single_zero || c.single_zero;
    }
};

template <class R>
struct Factors {
    Structure structure;
    R gain{};
    Pair<R> pole_pair[max_pairs]{};
    R pole{};  // s + pole, used when the number of poles is odd
    Pair<R> zero_pair[max_pairs]{};
    R zero{};

    Counts counts() const { return Counts(structure); }
};

// A conjugate pair -re +- i im, or two real roots -a1, -a2, as s^2 + e1 s + e0.
template <class R>
constexpr Pair<R> conjugate_pair(R re, R im) {
    return {R(2.0) * re, re * re + im * im};
}
template <class R>
constexpr Pair<R> real_pair(R a1, R a2) {
    return {a1 + a2, a1 * a2};
}

}  // namespace gaident
