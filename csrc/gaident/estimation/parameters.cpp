#include "parameters.hpp"

#include <cmath>

namespace gaident {

namespace {

double inside(double v, Range r) { return v < r.lo ? r.lo : (v > r.hi ? r.hi : v); }

Pair<double> inside(Pair<double> f, Range real, Range imaginary) {
    std::complex<double> a1, a2;
    split(f, a1, a2);
    if (a1.imag() != 0.0) {
        const double re = inside(a1.real(), real), im = std::min(std::abs(a1.imag()), imaginary.hi);
        return re == a1.real() && im == std::abs(a1.imag()) ? f : conjugate_pair(re, im);
    }
    const double r1 = inside(a1.real(), real), r2 = inside(a2.real(), real);
    return r1 == a1.real() && r2 == a2.real() ? f : real_pair(r1, r2);
}

void pack_roots(const Factors<double>& g, std::span<double> x) {
    std::size_t k = 1;
    for (int i = 0; i < g.structure.pole_pairs(); ++i, k += 2) x[k] = g.pole_pair[i].e1, x[k + 1] = g.pole_pair[i].e0;
    if (g.structure.single_pole()) x[k++] = g.pole;
    for (int i = 0; i < g.structure.zero_pairs(); ++i, k += 2) x[k] = g.zero_pair[i].e1, x[k + 1] = g.zero_pair[i].e0;
    if (g.structure.single_zero()) x[k++] = g.zero;
}

}  // namespace

std::vector<double> pack(const Factors<double>& g, const std::vector<double>& starts) {
    std::vector<double> x(static_cast<std::size_t>(g.structure.parameters()));
    x[0] = std::log(g.gain);
    pack_roots(g, x);
    x.insert(x.end(), starts.begin(), starts.end());
    return x;
}

Factors<double> unpack(std::span<const double> x, Structure s) {
    Factors<double> g;
    g.structure = s;
    std::size_t k = 0;
    g.gain = std::exp(x[k++]);
    for (int i = 0; i < s.pole_pairs(); ++i, k += 2) g.pole_pair[i] = {x[k], x[k + 1]};
    if (s.single_pole()) g.pole = x[k++];
    for (int i = 0; i < s.zero_pairs(); ++i, k += 2) g.zero_pair[i] = {x[k], x[k + 1]};
    if (s.single_zero()) g.zero = x[k++];
    return g;
}

void project(std::span<double> x, Structure s, const SearchRanges& r) {
    Factors<double> g = unpack(x, s);
    const double gain = inside(g.gain, r.gain_limits(s.p));
    for (int i = 0; i < s.pole_pairs(); ++i) g.pole_pair[i] = inside(g.pole_pair[i], r.real, r.imaginary);
    if (s.single_pole()) g.pole = inside(g.pole, r.real);
    for (int i = 0; i < s.zero_pairs(); ++i) g.zero_pair[i] = inside(g.zero_pair[i], r.real, r.imaginary);
    if (s.single_zero()) g.zero = inside(g.zero, r.real);
    if (gain != g.gain) x[0] = std::log(gain);  // exp and log need not be exact inverses
    pack_roots(g, x);
}

std::vector<bool> at_bounds(std::span<const double> x, Structure s, const SearchRanges& ranges) {
    std::vector<bool> at(static_cast<std::size_t>(s.parameters()), false);
    const auto near = [](double v, Range r) {
        const double tiny = 1e-9 * (r.hi - r.lo);
        return v <= r.lo + tiny || v >= r.hi - tiny;
    };
    const Factors<double> g = unpack(x, s);
    std::size_t k = 0;
    at[k++] = near(std::log(g.gain), {std::log(ranges.gain_limits(s.p).lo), std::log(ranges.gain_limits(s.p).hi)});
    const auto pair = [&](Pair<double> f) {
        std::complex<double> a1, a2;
        split(f, a1, a2);
        if (a1.imag() != 0.0) {
            at[k++] = near(a1.real(), ranges.real);
            at[k++] = std::abs(a1.imag()) >= ranges.imaginary.hi * (1.0 - 1e-9);
        } else {
            at[k++] = near(a1.real(), ranges.real);
            at[k++] = near(a2.real(), ranges.real);
        }
    };
    for (int i = 0; i < s.pole_pairs(); ++i) pair(g.pole_pair[i]);
    if (s.single_pole()) at[k++] = near(g.pole, ranges.real);
    for (int i = 0; i < s.zero_pairs(); ++i) pair(g.zero_pair[i]);
    if (s.single_zero()) at[k++] = near(g.zero, ranges.real);
    return at;
}

double step_size(std::span<const double> x, Structure s, double slowest, std::size_t i) {
    constexpr double relative = 1e-6;
    if (i == 0) return relative;
    std::size_t k = 1;
    const auto pairs = [&](int count, double& h) {
        for (int n = 0; n < count; ++n, k += 2) {
            const double w = std::max(std::sqrt(std::abs(x[k + 1])), slowest);
            if (i == k) h = relative * std::max(std::abs(x[k]), w);
            if (i == k + 1) h = relative * w * w;
        }
    };
    double h = 0.0;
    pairs(s.pole_pairs(), h);
    if (s.single_pole() && i == k++) h = relative * std::max(std::abs(x[i]), slowest);
    pairs(s.zero_pairs(), h);
    if (s.single_zero() && i == k++) h = relative * std::max(std::abs(x[i]), slowest);
    return h > 0.0 ? h : relative * std::max(std::abs(x[i]), 1e-3);
}

}  // namespace gaident
