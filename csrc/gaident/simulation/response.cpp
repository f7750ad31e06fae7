#include "response.hpp"

#include "../plant/held.hpp"

#include <algorithm>
#include <stdexcept>

namespace gaident {

namespace {

constexpr std::size_t block = 64;  // lines at once

// A complex number per line.
struct Lines {
    double real[block], imaginary[block];

    void fill(double value, std::size_t n) {
        std::fill_n(real, n, value);
        std::fill_n(imaginary, n, 0.0);
    }
    // times (real + j imaginary) of `of(k, real, imaginary)`
    template <class Of>
    void times(std::size_t n, const Of& of) {
        for (std::size_t k = 0; k < n; ++k) {
            double re, im;
            of(k, re, im);
            const double x = real[k];
            real[k] = x * re - imaginary[k] * im;
            imaginary[k] = x * im + imaginary[k] * re;
        }
    }
};

}  // namespace

Response::Response(std::span<const std::complex<double>> at, std::span<const std::complex<double>> value,
                   std::span<const double> weight, double sample_time, double slowest, double fastest, double noise)
    : weight_(weight.begin(), weight.end()), sample_time_(sample_time), slowest_(slowest), fastest_(fastest), noise_(noise) {
    if (weight.empty() || at.size() != weight.size() || value.size() != weight.size())
        throw std::invalid_argument("response: frequencies, values and weights must have the same length, at least 1");
    if (!(slowest > 0.0) || !(fastest >= slowest)) throw std::invalid_argument("response: its band must be positive");
    for (std::size_t k = 0; k < at.size(); ++k) {
        at_real_.push_back(at[k].real());
        at_imaginary_.push_back(at[k].imag());
        measured_.push_back(weight[k] * value[k].real());
        measured_.push_back(weight[k] * value[k].imag());
    }
}

void Response::plant(const Factors<double>& g, std::size_t first, std::span<double> real, std::span<double> imaginary) const {
    plant(g, held(g), first, real, imaginary);
}

Delta<double> Response::held(const Factors<double>& g) const {
    if (sample_time_ > 0.0) return held_plant(g, sample_time_, held_doublings(largest_root(g), sample_time_));
    return {};
}

void Response::plant(const Factors<double>& g, const Delta<double>& held, std::size_t first, std::span<double> real,
                     std::span<double> imaginary) const {
    for (std::size_t from = 0; from < real.size(); from += block) {
        const std::size_t n = std::min(block, real.size() - from);
        const double *const x = at_real_.data() + first + from, *const y = at_imaginary_.data() + first + from;
        const auto single = [&](double e0) { return [=](std::size_t k, double& re, double& im) { re = x[k] + e0, im = y[k]; }; };
        const auto pair = [&](Pair<double> f) {
            return [=](std::size_t k, double& re, double& im) {
                re = (x[k] + f.e1) * x[k] - y[k] * y[k] + f.e0;
                im = (2.0 * x[k] + f.e1) * y[k];
            };
        };
        Lines above, below;
        if (sample_time_ > 0.0) {
            // Horner
            const auto polynomial = [&](Lines& c, double leading, const double* rest) {
                c.fill(leading, n);
                for (int i = 0; i < held.order; ++i) {
                    c.times(n, single(0.0));
                    for (std::size_t k = 0; k < n; ++k) c.real[k] += rest[i];
                }
            };
            polynomial(above, held.b[0], held.b + 1);
            polynomial(below, 1.0, held.a);
        } else {
            const Structure s = g.structure;
            above.fill(g.gain, n);
            below.fill(1.0, n);
            for (int i = 0; i < s.zero_pairs(); ++i) above.times(n, pair(g.zero_pair[i]));
            if (s.single_zero()) above.times(n, single(g.zero));
            for (int i = 0; i < s.pole_pairs(); ++i) below.times(n, pair(g.pole_pair[i]));
            if (s.single_pole()) below.times(n, single(g.pole));
        }
        for (std::size_t k = 0; k < n; ++k) {
            const double size = below.real[k] * below.real[k] + below.imaginary[k] * below.imaginary[k];
            real[from + k] = (above.real[k] * below.real[k] + above.imaginary[k] * below.imaginary[k]) / size;
            imaginary[from + k] = (above.imaginary[k] * below.real[k] - above.real[k] * below.imaginary[k]) / size;
        }
    }
}

void Response::weighted(const Factors<double>& g, std::size_t first, std::span<double> numbers) const {
    std::vector<double> parts(numbers.size());
    const std::span<double> all(parts), real = all.first(numbers.size() / 2), imaginary = all.last(numbers.size() / 2);
    plant(g, first, real, imaginary);
    for (std::size_t k = 0; k < real.size(); ++k) {
        numbers[2 * k] = weight_[first + k] * real[k];
        numbers[2 * k + 1] = weight_[first + k] * imaginary[k];
    }
}

double Response::error_sum(const Factors<double>& g) const {
    const Delta<double> behind_hold = held(g);
    double sum = 0.0, real[block], imaginary[block];
    for (std::size_t first = 0; first < size(); first += block) {
        const std::size_t n = std::min(block, size() - first);
        plant(g, behind_hold, first, {real, n}, {imaginary, n});
        for (std::size_t k = 0; k < n; ++k) {
            const double* const at = measured_.data() + 2 * (first + k);
            const double re = at[0] - weight_[first + k] * real[k], im = at[1] - weight_[first + k] * imaginary[k];
            sum += re * re + im * im;
        }
    }
    return sum;
}

}  // namespace gaident
