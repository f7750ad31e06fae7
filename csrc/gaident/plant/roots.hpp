// Factors from poles and zeros, and back.
#pragma once

#include "factors.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <span>
#include <stdexcept>
#include <string>

namespace gaident {

// The numbers A (or B) of a pair: the negated roots of s^2 + e1 s + e0. Real ones are found without cancellation.
inline void split(Pair<double> f, std::complex<double>& a1, std::complex<double>& a2) {
    const double half = 0.5 * f.e1, d = half * half - f.e0;
    if (d < 0.0) {
        a1 = {half, std::sqrt(-d)};
        a2 = std::conj(a1);
    } else {
        const double big = half >= 0.0 ? half + std::sqrt(d) : half - std::sqrt(d);
        a1 = big;
        a2 = big != 0.0 ? f.e0 / big : 0.0;
    }
}

namespace detail {

// Roots (poles or zeros themselves, not negated) into pairs and at most one single.
inline void gather(std::span<const std::complex<double>> roots, Pair<double>* pairs, double& single, const char* what) {
    std::complex<double> rest[max_plant_order];
    int pairs_made = 0, reals = 0;
    double real[max_plant_order];
    std::size_t n = roots.size();
    std::copy(roots.begin(), roots.end(), rest);
    for (std::size_t i = 0; i < n; ++i) {
        if (rest[i].imag() == 0.0) {
            // Sorted by magnitude, so that neighbours share a pair: a local fit can turn two close real roots into complex ones.
            int at = reals++;
            for (; at > 0 && std::abs(real[at - 1]) < std::abs(rest[i].real()); --at) real[at] = real[at - 1];
            real[at] = -rest[i].real();
            continue;
        }
        std::size_t j = i + 1;
        while (j < n && rest[j] != std::conj(rest[i])) ++j;
        if (j == n) throw std::invalid_argument(std::string(what) + ": a complex root has no conjugate partner");
        pairs[pairs_made++] = conjugate_pair(-rest[i].real(), std::abs(rest[i].imag()));
        std::copy(rest + j + 1, rest + n, rest + j);
        --n;
    }
    int i = 0;
    for (; i + 1 < reals; i += 2) pairs[pairs_made++] = real_pair(real[i], real[i + 1]);
    if (i < reals) single = real[i];
}

}  // namespace detail

inline Factors<double> factors_from_roots(double gain, std::span<const std::complex<double>> poles,
                                          std::span<const std::complex<double>> zeros) {
    if (zeros.size() > poles.size()) throw std::invalid_argument("zeros: more zeros than poles");
    if (poles.size() > max_plant_order || zeros.size() > max_plant_order / 2)
        throw std::invalid_argument("poles: at most 14 poles and 7 zeros");
    Factors<double> f;
    f.structure = {static_cast<int>(poles.size() - zeros.size()), static_cast<int>(zeros.size())};
    f.gain = gain;
    detail::gather(poles, f.pole_pair, f.pole, "poles");
    detail::gather(zeros, f.zero_pair, f.zero, "zeros");
    return f;
}

// The way back: roots (not negated) into arrays of p + q and q numbers.
inline void roots_of(const Factors<double>& f, std::complex<double>* poles, std::complex<double>* zeros) {
    std::complex<double> a1, a2;
    int n = 0;
    for (int i = 0; i < f.structure.pole_pairs(); ++i) {
        split(f.pole_pair[i], a1, a2);
        poles[n++] = -a1;
        poles[n++] = -a2;
    }
    if (f.structure.single_pole()) poles[n++] = -f.pole;
    n = 0;
    for (int i = 0; i < f.structure.zero_pairs(); ++i) {
        split(f.zero_pair[i], a1, a2);
        zeros[n++] = -a1;
        zeros[n++] = -a2;
    }
    if (f.structure.single_zero()) zeros[n++] = -f.zero;
}

}  // namespace gaident
