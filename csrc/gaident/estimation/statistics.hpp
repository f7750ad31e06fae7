// What uncertainty and tests of a fit need of its residual, gathered chunk by chunk: nothing as long as a record is kept.
#pragma once

#include "sweep.hpp"

namespace gaident {

// Of the residual e = w - wm.
struct ResidualSums {
    std::vector<double> products;  // sum over records of sum_n e(n) e(n+k), k = 0..lags
    double largest_output = 0.0;   // max |wm|
};

ResidualSums residual_sums(const Experiment& experiment, const Factors<double>& g, const std::vector<double>& starts,
                           std::size_t lags);

// Sums of products of the derivatives J = de/dx and of regressors that a linear model's residual must not depend on.
struct FitSums {
    std::size_t unknowns = 0, regressors = 0;
    std::vector<double> plain;  // J'J
    std::vector<double>
        coloured;  // J'S J for the covariance S = F^-1 F'^-1 of noise with the autoregression phi and unit innovations
    std::vector<double> white;  // X'X of X = F [e | J | regressors], samples without their past left out
};

// F = 1 - sum phi_i z^-i.
// S is that of stationary noise: since J'S J is the same forwards and backwards in time, it is the sum of squares of J coloured
// forwards, z(n) = J(n) + sum phi_i z(n-i), beyond the end of the record until it has died away.
//
// Regressors: the input at lags[0], then its change from each lag to the next; 1; sign(wm) where |wm| > threshold; wm |wm|.
FitSums fit_sums(const Experiment& experiment, const Factors<double>& g, const std::vector<double>& starts,
                 std::span<const double> phi, std::span<const int> lags, double threshold);

}  // namespace gaident
