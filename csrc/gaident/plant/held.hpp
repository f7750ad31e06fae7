// The plant behind a zero-order hold, exactly, built in delta = z - 1 with additions and multiplications only.
//
// Time in units of Ts: s' = s Ts, G = K Ts^p prod (s'+b')/prod (s'+a').
// The factors form a cascade of sections of order two (one of order one if the number of poles is odd); with the held torque as
// state 0 the whole is dx/dt = M x, M block lower triangular, and
//
//     F = e^M - 1 = [ 0 0 ; Gamma Phi-1 ]    by its Taylor series for M/2^k and k doublings F(2X) = 2 F(X) + F(X)^2.
//
// Computing e^M - 1 and not e^M loses no digits of slow poles.
// The denominator is the product of the characteristic polynomials of F's diagonal blocks; the numerator follows from the
// delta-Markov numbers h_k = C (Phi-1)^k Gamma: B(delta) = A(delta) * sum_k h_k delta^(-k-1).
#pragma once

#include "delta.hpp"

#include <algorithm>
#include <cmath>

namespace gaident {

namespace detail {

inline constexpr int held_states = max_plant_order + 1;  // the torque and the plant's states

// Block lower triangular: entry (i, j) may be nonzero only for j <= i + 1. `size`: rows when known at compile time, -1 otherwise.
template <class R, int size>
struct Hessenberg {
    static constexpr int capacity = size > 0 ? size : held_states;
    int runtime_rows;
    R m[capacity][capacity];

    explicit Hessenberg(int n) : runtime_rows(n) {}
    int rows() const { return size > 0 ? size : runtime_rows; }
    static int last(int row, int n) { return row + 1 < n ? row + 1 : n - 1; }

    friend Hessenberg product(const Hessenberg& x, const Hessenberg& y) {
        const int n = x.rows();
        Hessenberg r(n);
        // The blocks of x and y are aligned, so the product keeps their shape.
        for (int i = 0; i < n; ++i)
            for (int j = 0; j <= last(i, n); ++j) {
                const int first = j > 0 ? j - 1 : 0;
                R sum = x.m[i][first] * y.m[first][j];
                for (int k = first + 1; k <= last(i, n); ++k) sum = fma(x.m[i][k], y.m[k][j], sum);
                r.m[i][j] = sum;
            }
        return r;
    }

    template <class F>
    void each(F&& f) {
        const int n = rows();
        for (int i = 0; i < n; ++i)
            for (int j = 0; j <= last(i, n); ++j) f(m[i][j], i, j);
    }
};

inline constexpr int taylor_terms = 11;  // (1/8)^12 / 12! is below one unit in the last place of a double

template <class R, int size>
Hessenberg<R, size> expm1(Hessenberg<R, size> x, int doublings) {
    double scale = 1.0;
    for (int i = 0; i < doublings; ++i) scale *= 0.5;
    x.each([&](R& e, int, int) { e = e * R(scale); });
    // Horner: x (1 + x/2 (1 + x/3 (...)))
    Hessenberg<R, size> f = x;
    for (int k = taylor_terms; k >= 2; --k) {
        f.each([&](R& e, int, int) { e = e * R(1.0 / k); });
        const Hessenberg<R, size> xf = product(x, f);
        f.each([&](R& e, int i, int j) { e = x.m[i][j] + xf.m[i][j]; });
    }
    for (int d = 0; d < doublings; ++d) {
        const Hessenberg<R, size> ff = product(f, f);
        f.each([&](R& e, int i, int j) { e = (e + e) + ff.m[i][j]; });
    }
    return f;
}

}  // namespace detail

// Doublings that bring every factor of a plant with roots up to `largest_root` [rad/s] to a norm of at most 1/8.
inline int held_doublings(double largest_root, double sample_time) {
    const double x = largest_root * sample_time;
    double norm = 2.0 + x * x + 2.0 * x;
    int k = 0;
    while (norm > 0.125 && k < 40) {
        norm *= 0.5;
        ++k;
    }
    return k;
}

inline double largest_root(const Factors<double>& g) {
    double r = 0.0;
    const auto pair = [&](Pair<double> f) { r = std::max(r, std::max(std::abs(f.e1), std::sqrt(std::abs(f.e0)))); };
    for (int i = 0; i < g.structure.pole_pairs(); ++i) pair(g.pole_pair[i]);
    for (int i = 0; i < g.structure.zero_pairs(); ++i) pair(g.zero_pair[i]);
    if (g.structure.single_pole()) r = std::max(r, std::abs(g.pole));
    if (g.structure.single_zero()) r = std::max(r, std::abs(g.zero));
    return r;
}

// Needs p >= 1: a plant that passes its torque straight through has no held form.
// `N`: the plant's order when known at compile time, so that the loops over its states unroll; -1 otherwise.
template <class R, int N, class Plant>
Delta<R, N> held_plant(const Plant& g, double sample_time, int doublings) {
    using Matrix = detail::Hessenberg<R, N + 1>;
    const Counts s = g.counts();
    const int n = N >= 0 ? N : s.order;
    const R Ts = R(sample_time), zero = R(0.0), one = R(1.0);

    // Output of the cascade so far, as a row over [torque, states].
    R row[detail::held_states];
    for (R& r : row) r = zero;
    row[0] = one;

    Matrix M(n + 1);
    M.each([&](R& e, int, int) { e = zero; });
    int state = 1;
    int zeros_left = s.zero_pairs;
    bool single_zero_left = s.single_zero;
    const int pairs = n / 2;
    const bool single_pole = n % 2 != 0;
    for (int i = 0; i < pairs; ++i) {
        // x1' = x2, x2' = -e0 x1 - e1 x2 + v;   y = n2 v + (n0 - n2 e0) x1 + (n1 - n2 e1) x2
        const R e1 = g.pole_pair[i].e1 * Ts, e0 = (g.pole_pair[i].e0 * Ts) * Ts;
        M.m[state][state + 1] = one;
        for (int j = 0; j < state; ++j) M.m[state + 1][j] = row[j];
        M.m[state + 1][state] = -e0;
        M.m[state + 1][state + 1] = -e1;
        if (zeros_left > 0) {
            --zeros_left;
            row[state] = (g.zero_pair[zeros_left].e0 * Ts) * Ts - e0;
            row[state + 1] = g.zero_pair[zeros_left].e1 * Ts - e1;
        } else {
            const bool with_zero = single_zero_left && !single_pole;
            for (int j = 0; j < state; ++j) row[j] = zero;
            row[state] = with_zero ? g.zero * Ts : one;
            row[state + 1] = with_zero ? one : zero;
            if (with_zero) single_zero_left = false;
        }
        state += 2;
    }
    if (single_pole) {
        const R a = g.pole * Ts;
        for (int j = 0; j < state; ++j) M.m[state][j] = row[j];
        M.m[state][state] = -a;
        if (single_zero_left) {
            row[state] = g.zero * Ts - a;
        } else {
            for (int j = 0; j < state; ++j) row[j] = zero;
            row[state] = one;
        }
    }

    const Matrix F = detail::expm1(M, doublings);

    Polynomial<R, N> denominator(one, n);
    for (int i = 0; i < pairs; ++i) {
        const int k = 1 + 2 * i;
        const R f11 = F.m[k][k], f12 = F.m[k][k + 1], f21 = F.m[k + 1][k], f22 = F.m[k + 1][k + 1];
        denominator.times(one, -(f11 + f22), fnma(f12, f21, f11 * f22));
    }
    if (single_pole) denominator.times(one, -F.m[n][n]);

    R gain = g.gain;
    for (int i = 0; i < s.p; ++i) gain = gain * Ts;

    // x = F^k Gamma, h_k = row . x; the held torque's own entry of `row` is zero because p >= 1.
    R x[detail::held_states], markov[max_plant_order];
    for (int i = 1; i <= n; ++i) x[i] = F.m[i][0];
    for (int k = 0; k < n; ++k) {
        R h = zero, next[detail::held_states];
        for (int i = 1; i <= n; ++i) h = fma(row[i], x[i], h);
        markov[k] = gain * h;
        for (int i = 1; i <= n; ++i) {
            R sum = zero;
            for (int j = 1; j <= Matrix::last(i, n + 1); ++j) sum = fma(F.m[i][j], x[j], sum);
            next[i] = sum;
        }
        for (int i = 1; i <= n; ++i) x[i] = next[i];
    }

    Delta<R, N> d;
    d.order = n;
    for (int i = 0; i < n; ++i) d.a[i] = denominator.c[i + 1];
    d.b[0] = zero;
    for (int k = 0; k < n; ++k) {
        R sum = zero;
        for (int j = 0; j <= k; ++j) sum = fma(denominator.c[k - j], markov[j], sum);
        d.b[k + 1] = sum;
    }
    return d;
}

template <class R>
Delta<R> held_plant(const Factors<R>& g, double sample_time, int doublings) {
    return held_plant<R, -1>(g, sample_time, doublings);
}

}  // namespace gaident
