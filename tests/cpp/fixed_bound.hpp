// By how much a fitness in fixed point may differ from double's at the most, for a record under a constant command: from the
// binary points alone, candidate by candidate.
//
// Coefficients.
// A FixedNumber is right within u = 2^-31 of itself, a quotient within 2 u.
// So the same templates, run in a number that carries its error along, bound the error of every coefficient (all terms are
// positive, nothing cancels): da[i], db[i].
//
// States. With the deviation from rest, the run in fixed point is (closed_loop.hpp, without input)
//
//     x[i](n+1) = x[i](n) + x[i+1](n) - a[i] y(n) + e[i](n),   y = x[0],   |e[i]| <= r[i] + da[i] Y
//
// r[i] = 2^-(point+1) being half the last bit of the state's word (the 16 guard bits make it a ten-thousandth more), Y the
// largest |y| of this run.
// Where it starts it is off by s[i]: roundings of the state, of the command it is taken from, and of the coefficients.
// With g[i](n) the answer of y to a unit in x[i], it is off from double's run by
//
//     |dy(n)| <= R(n) + C(n) Y,   R = sum_i ( s[i] |g[i](n)| + r[i] G[i](n) ),   C = sum_i da[i] G[i](n),
//     G[i](n) = sum_(k<n) |g[i](k)|
//
// and Y <= (max|y| of double's run + max R)/(1 - max C).
//
// Sum of squares.
// An error e(n) of double's run becomes one within d(n) = |dy(n)| + two roundings of the samples, and from every square less than
// one unit of the sum's last bit is dropped:
//
//     |dF| <= Wf1^2 sum_n ( 2 |e(n)| d(n) + d(n)^2 + 2^-sum_point ) + 4 u F
#pragma once

#include "gaident/target/fixed_scaling.hpp"
#include "gaident/simulation/simulate.hpp"

namespace gaident {

// A number and its error in fixed point, in units of u.
struct Doubtful {
    double value = 0.0, error = 0.0;

    Doubtful() = default;
    explicit Doubtful(double x) : value(x), error(std::abs(x)) {}
    Doubtful(double x, double from_operands, double own) : value(x), error(from_operands + own * std::abs(x)) {}
    explicit operator double() const { return value; }
};
inline Doubtful operator+(Doubtful a, Doubtful b) { return {a.value + b.value, a.error + b.error, 1.0}; }
inline Doubtful operator-(Doubtful a, Doubtful b) { return {a.value - b.value, a.error + b.error, 1.0}; }
inline Doubtful operator-(Doubtful a) { return {-a.value, a.error, 0.0}; }
inline Doubtful operator*(Doubtful a, Doubtful b) {
    return {a.value * b.value, std::abs(a.value) * b.error + std::abs(b.value) * a.error, 1.0};
}
inline Doubtful fma(Doubtful a, Doubtful b, Doubtful c) { return c + a * b; }
inline Doubtful fnma(Doubtful a, Doubtful b, Doubtful c) { return c - a * b; }
inline Doubtful operator/(Doubtful a, Doubtful b) {
    return {a.value / b.value, (a.error + std::abs(a.value / b.value) * b.error) / std::abs(b.value), 2.0};
}
inline Doubtful clamp(Doubtful x, Doubtful, Doubtful) { return x; }

// The bound of |dF| without its last term, Wf1 = 1, for one record; `peak` as the search has it.
inline double error_sum_bound(int headroom, const Factors<double>& exact, const Factors<Doubtful>& doubtful, const Record& r,
                              const Loop& loop, const SearchRanges& ranges, double peak) {
    constexpr double u = 1.01 / 2147483648.0;  // the hundredth more: products of errors
    const FixedScaling scaling(Extent{peak, r.size(), &ranges, loop.controller, Clock{r.sample_time}}, headroom);
    const Delta<double> h = close_loop(bilinear_plant(exact, r.sample_time), loop.controller, Clock{r.sample_time});
    const Delta<Doubtful> d = close_loop(bilinear_plant(doubtful, r.sample_time), loop.controller, Clock{r.sample_time});
    const Prepared start = prepare(exact, r, loop, nullptr);
    const double command = r.input[0], half_sample = std::exp2(-scaling.signal_point - 1);
    const auto a = [&](int k) { return d.a[k]; };
    const auto b = [&](int k) { return d.b[k]; };

    double x[max_loop_order];
    for (int i = 0; i < h.order; ++i) x[i] = (r.start == Start::rest ? 0.0 : start.x[i]) - at_rest(i, a, b).value * command;
    std::vector<double> y(r.size()), R(r.size(), 0.0), C(r.size(), 0.0);
    double most = 0.0;
    for (double& v : y) {
        v = recurrence_step<double, -1, false>(h.order, h.a, h.b, x, 0.0);
        most = std::max(most, std::abs(v));
    }
    for (int i = 0; i < h.order; ++i) {
        const int point = i == 0 ? scaling.signal_point : scaling.states[exact.structure.p][exact.structure.q].at[i];
        const double rounding = 1.0001 * std::exp2(-point - 1);
        const Doubtful rest = at_rest(i, a, b);
        const double begin = 2.0 * rounding + std::abs(rest.value) * half_sample + u * rest.error * std::abs(command);
        double g[max_loop_order] = {}, sum = 0.0;
        g[i] = 1.0;
        for (std::size_t k = 0; k < r.size(); ++k) {
            const double response = std::abs(recurrence_step<double, -1, false>(h.order, h.a, h.b, g, 0.0));
            R[k] += begin * response + rounding * sum;
            C[k] += u * d.a[i].error * sum;
            sum += response;
        }
    }
    const auto largest = [](const std::vector<double>& v) { return *std::max_element(v.begin(), v.end()); };
    if (!(largest(C) < 1.0)) return std::numeric_limits<double>::infinity();
    const double Y = (most + largest(R)) / (1.0 - largest(C));
    double bound = static_cast<double>(r.size()) * std::exp2(FixedErrorSum::dropped - 2 * scaling.signal_point);
    for (std::size_t k = 0; k < r.size(); ++k) {
        const double deviation = R[k] + C[k] * Y + 2.0 * half_sample;
        bound += (2.0 * std::abs(r.output[k] - command - y[k]) + deviation) * deviation;
    }
    return bound;
}

}  // namespace gaident
