// Where the binary points of a fixed-point search stand: from the ranges of its genes and the record's peak, before the run.
//
// A signal has the point at which peak * 2^headroom still fits a word; headroom is the word's split.
// State x[i] of the recurrence is, in terms of the output and its differences d^k y (substitute x[i+1] = d x[i] - b[i+1] r + a[i]
// y),
//
//     x[i] = d^i y + a[0] d^(i-1) y + ... + a[i-1] y - b[0] d^i r - ... - b[i] r
//
// and, summed up over T samples (substitute x[i](n+1) - x[i](n) = x[i+1] + b[i+1] r - a[i] y from the last state on) from where
// it may start, at rest or away from it (closed_loop.hpp: at_rest),
//
//     |x[i]| <= peak (|a[i-1] - b[i]| + sum_j (a[i+j] + b[i+j+1]) T^(j+1) / (j+1)!)
//
// The coefficients are largest for the structure's fastest and strongest plant, the end of every range, and a difference is at
// most min(1, a[0]) of what it is taken of.
// The smaller bound counts: the first for the early states, the second for the last.
// So each structure has its own points, one per state.
#pragma once

#include "candidate.hpp"
#include "../numeric/apart.hpp"
#include "../numeric/bit_cast.hpp"
#include "../numeric/fixed.hpp"

namespace gaident {

// The end of every range: all roots conjugate pairs as fast as they get.
inline Factors<Apart> end_of_ranges(const SearchRanges& ranges, Structure s) {
    const auto size = [](Range r) {
        const double lo = r.lo < 0.0 ? -r.lo : r.lo, hi = r.hi < 0.0 ? -r.hi : r.hi;
        return lo < hi ? hi : lo;
    };
    const double re = size(ranges.real), im = size(ranges.imaginary);
    const Pair<double> both = conjugate_pair(re, im);
    Factors<Apart> f;
    f.structure = s;
    f.gain = Apart(ranges.gain.hi * ranges.gain_unit(s.p));
    for (Pair<Apart>& pair : f.pole_pair) pair = {Apart(both.e1), Apart(both.e0)};
    for (Pair<Apart>& pair : f.zero_pair) pair = {Apart(both.e1), Apart(both.e0)};
    f.pole = f.zero = Apart(re);
    return f;
}

// The largest binary point at which `size` fits a word.
constexpr int point_for(double size) {
    const int e = static_cast<int>(bit_cast<std::uint64_t>(size) >> 52 & 0x7FF) - 1023;  // size < 2^(e+1)
    return 30 - e;
}

struct StatePoints {
    std::int8_t at[max_loop_order + 1] = {};

    StatePoints() = default;
    // `h`: the closed loop with the largest coefficients; `peak`: of the signals, headroom included; `T`: samples
    StatePoints(const Delta<Apart>& h, double peak, double T) {
        const auto size = [](Apart x) { return x.v < 0.0 ? -x.v : x.v; };
        const double rate = h.order > 0 && size(h.a[0]) < 1.0 ? size(h.a[0]) : 1.0;
        double bound = 1.0;  // of d^i y + a[0] d^(i-1) y + ... + a[i-1] y
        for (int i = 0; i < h.order; ++i) {
            if (i > 0) bound = rate * bound + size(h.a[i - 1]);
            const double by_differences = bound + (i > 0 ? size(h.b[i]) : 0.0);
            double by_sums = i > 0 ? size(h.a[i - 1] - h.b[i]) : 1.0, power = 1.0;
            for (int j = 0; i + j < h.order; ++j) {
                power *= T / static_cast<double>(j + 1);
                by_sums += (size(h.a[i + j]) + size(h.b[i + j + 1])) * power;
            }
            const int point = i == 0 ? point_for(peak) : point_for(peak * (by_sums < by_differences ? by_sums : by_differences));
            at[i] = static_cast<std::int8_t>(point < 120 ? point : 120);
        }
    }
};

struct FixedScaling {
    int signal_point = 0;
    StatePoints states[Genome::max_order + 1][Genome::max_order + 1];  // [p][q]

    FixedScaling() = default;
    FixedScaling(const Extent& extent, int headroom) {
        const double peak = (extent.peak > 0.0 ? extent.peak : 1.0) * static_cast<double>(1 << headroom);
        signal_point = point_for(peak);
        for (int p = extent.ranges->p_min; p <= extent.ranges->p_max; ++p)
            for (int q = extent.ranges->q_min; q <= extent.ranges->q_max; ++q) {
                const Factors<Apart> end = end_of_ranges(*extent.ranges, {p, q});
                const Delta<Apart> plant = bilinear_plant(end, extent.clock.period);
                states[p][q] =
                    StatePoints(close_loop(plant, extent.controller, extent.clock), peak, static_cast<double>(extent.samples));
            }
    }
};

template <int headroom>
struct FixedPoint {
    using Number = FixedNumber;
    using Signal = FixedSignal;
    using Sample = std::int32_t;
    using State = FixedSignal;
    using Sum = FixedErrorSum;
    struct Scaling : FixedScaling {
        Scaling() = default;
        explicit Scaling(const Extent& extent) : FixedScaling(extent, headroom) {}
    };
    static constexpr double room = static_cast<double>(1 << headroom);
    static constexpr int orders_in_registers = 0;
    static constexpr Sample sample(double x, const Scaling& s) { return FixedSignal::of(x, s.signal_point).word; }
    static constexpr Signal signal(Sample x, const Scaling& s) { return {x, s.signal_point, false}; }
    static constexpr Sample store(const Signal& x) { return x.word; }
    static State state(const Scaling& scaling, Structure s, int i, double value = 0.0) {
        const int point = i == 0 ? scaling.signal_point : scaling.states[s.p][s.q].at[i];  // x[0] is a velocity
        return value == 0.0 ? FixedSignal(0, point, false) : FixedSignal::of(value, point);
    }
    static Sum no_error(const Scaling& s) {
        FixedErrorSum sum;
        sum.point = 2 * s.signal_point - FixedErrorSum::dropped;
        return sum;
    }
    static constexpr Number worst() { return FixedNumber::largest(); }
    // A saturated response is not that of the model: the worst.
    static constexpr Number error(const Sum& sum) { return sum.saturated ? worst() : FixedNumber::normal(sum.value, sum.point); }
};

}  // namespace gaident
