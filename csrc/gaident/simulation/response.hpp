// A measured frequency response, and how far a plant is from it:
//
//     J = sum_k (w_k |G_k - G(s_k)|)^2,   w_k: a weight, 1 over the standard deviation of G_k
//
// G of its factors at s_k = j omega_k, or behind a zero-order hold, where s_k = e^(j omega_k Ts) - 1 and G = b(s)/a(s) is the discrete
// plant of held.hpp.
#pragma once

#include "../plant/delta.hpp"

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace gaident {

class Response {
public:
    // sample_time: of the hold [s], 0: none. band: its lowest and highest frequency [rad/s]. noise: J of a perfect plant, 0: unknown.
    // Throws std::invalid_argument where the lengths differ or are 0.
    Response(std::span<const std::complex<double>> at, std::span<const std::complex<double>> value,
             std::span<const double> weight, double sample_time, double slowest, double fastest, double noise);

    std::size_t size() const { return weight_.size(); }
    // Real and imaginary parts are numbers of their own.
    std::size_t numbers() const { return 2 * size(); }
    double slowest() const { return slowest_; }
    double fastest() const { return fastest_; }
    double noise() const { return noise_; }

    // G at the lines first, first + 1, ...; as many as `real` and `imaginary` have room for.
    void plant(const Factors<double>& g, std::size_t first, std::span<double> real, std::span<double> imaginary) const;
    // w Re, w Im of the lines first, first + 1, ..., in turn: of the plant, and as measured.
    void weighted(const Factors<double>& g, std::size_t first, std::span<double> numbers) const;
    std::span<const double> measured() const { return measured_; }
    // J
    double error_sum(const Factors<double>& g) const;

private:
    Delta<double> held(const Factors<double>& g) const;
    void plant(const Factors<double>& g, const Delta<double>& held, std::size_t first, std::span<double> real,
               std::span<double> imaginary) const;

    std::vector<double> at_real_, at_imaginary_, weight_, measured_;
    double sample_time_, slowest_, fastest_, noise_;
};

}  // namespace gaident
