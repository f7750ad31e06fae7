#include "neighbours.hpp"

#include <algorithm>
#include <cmath>

namespace gaident {

namespace {

struct Roots {
    std::complex<double> poles[max_plant_order], zeros[max_plant_order];
    std::size_t n = 0, q = 0;

    explicit Roots(const Factors<double>& g)
        : n(static_cast<std::size_t>(g.structure.poles())), q(static_cast<std::size_t>(g.structure.q)) {
        roots_of(g, poles, zeros);
    }
    void pole(std::complex<double> s) { poles[n++] = s; }
    void zero(std::complex<double> s) { zeros[q++] = s; }
    void take_pole(std::size_t i) { poles[i] = poles[--n]; }
    void take_zero(std::size_t i) { zeros[i] = zeros[--q]; }
    Factors<double> factors(double gain) const { return factors_from_roots(gain, {poles, n}, {zeros, q}); }
};

}  // namespace

bool may_grow(Structure from, Structure to) {
    const int dp = to.p - from.p, dq = to.q - from.q;
    return (dp == 0 && (dq == 1 || dq == 2)) || (dq == 0 && (dp == 1 || dp == 2));
}

std::vector<Factors<double>> grow(const Factors<double>& from, Structure to, const SearchRanges& ranges, double slowest,
                                  double fastest) {
    const int dp = to.p - from.structure.p, dq = to.q - from.structure.q;
    std::vector<Factors<double>> made;
    const auto grid = [&](double lo, double hi, auto&& use) {
        lo = std::max(lo, slowest);
        hi = std::min(hi, fastest);
        if (!(hi > lo)) return;
        for (int k = 0; k < grid_points; ++k) use(lo * std::pow(hi / lo, (k + 0.5) / grid_points));
    };
    const auto resonance = [&](double w, double ratio, double damping, double gain) {
        Roots r(from);
        const auto pair = [&](double f, auto&& put) {
            const std::complex<double> s{-damping * f, f};
            put(s);
            put(std::conj(s));
        };
        pair(w, [&](std::complex<double> s) { r.zero(s); });
        pair(w * ratio, [&](std::complex<double> s) { r.pole(s); });
        made.push_back(r.factors(from.gain * gain));
    };
    if (dp == 0 && dq == 2) {
        grid(ranges.imaginary.lo, ranges.imaginary.hi, [&](double w) {
            for (const double ratio : {0.8, 1.1, 1.6})
                for (const double damping : {0.03, 0.2}) {
                    resonance(w, ratio, damping, 1.0);
                    resonance(w, ratio, damping, ratio * ratio);
                }
        });
    } else if (dp == 0 && dq == 1) {
        grid(ranges.real.lo, ranges.real.hi, [&](double a) {
            for (const double ratio : {0.5, 0.9, 1.1, 2.0})
                for (const double gain : {1.0, ratio}) {
                    Roots r(from);
                    r.zero(-a);
                    r.pole(-a * ratio);
                    made.push_back(r.factors(from.gain * gain));
                }
        });
    } else if (dp == 1 && dq == 0) {
        grid(ranges.real.lo, ranges.real.hi, [&](double a) {
            Roots r(from);
            r.pole(-a);
            made.push_back(r.factors(from.gain * a));
        });
    } else if (dp == 2 && dq == 0) {
        grid(ranges.imaginary.lo, ranges.imaginary.hi, [&](double w) {
            for (const double damping : {0.1, 0.6}) {
                Roots r(from);
                const std::complex<double> s{-damping * w, w};
                r.pole(s);
                r.pole(std::conj(s));
                made.push_back(r.factors(from.gain * w * w * (1.0 + damping * damping)));
            }
        });
    }
    return made;
}

std::vector<Factors<double>> shrink(const Factors<double>& from, Structure to) {
    const int dp = from.structure.p - to.p, dq = from.structure.q - to.q;
    std::vector<Factors<double>> made;
    if (!may_grow(to, from.structure)) return made;
    const Roots all(from);
    const bool pairs = dp == 2 || dq == 2;  // real ones in pairs are reached one by one
    // Conjugate roots stand side by side, the first of them at i.
    const auto fits = [&](const std::complex<double>* roots, std::size_t i, std::size_t count) {
        return pairs ? i + 1 < count && roots[i].imag() != 0.0 && roots[i + 1] == std::conj(roots[i]) : roots[i].imag() == 0.0;
    };
    const auto take = [&](std::size_t pole, std::size_t zero) {
        Roots r = all;
        double gain = from.gain;
        const auto size = [](std::complex<double> s) { return std::max(std::abs(s), 1e-6); };
        for (int k = 0; k < (pairs ? 2 : 1); ++k) {
            gain /= size(all.poles[pole + static_cast<std::size_t>(k)]);
            if (dq > 0) gain *= size(all.zeros[zero + static_cast<std::size_t>(k)]);
        }
        if (pairs) r.take_pole(pole + 1);
        r.take_pole(pole);
        if (dq > 0) {
            if (pairs) r.take_zero(zero + 1);
            r.take_zero(zero);
        }
        made.push_back(r.factors(gain));
    };
    for (std::size_t i = 0; i < all.n; ++i) {
        if (!fits(all.poles, i, all.n)) continue;
        if (dq == 0) take(i, 0);
        for (std::size_t j = 0; dq > 0 && j < all.q; ++j)
            if (fits(all.zeros, j, all.q)) take(i, j);
        if (pairs) ++i;
    }
    return made;
}

}  // namespace gaident
