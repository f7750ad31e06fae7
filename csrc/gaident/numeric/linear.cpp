#include "linear.hpp"

#include <cmath>

namespace gaident {

void solve_damped(std::span<const double> A, std::span<const double> b, const double (&factors)[damping_lanes],
                  std::vector<double>& work, std::span<double> s) {
    constexpr std::size_t W = damping_lanes;
    const std::size_t n = b.size();
    work.resize(n * n * W);
    double* const L = work.data();  // the lower triangle, [i][j][lane]; on the diagonal its inverse
    double sound[W];
    for (double& v : sound) v = 1.0;
    const auto at = [&](std::size_t i, std::size_t j) { return L + (i * n + j) * W; };
    for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t i = j; i < n; ++i) {
            double sum[W];
            // The last term keeps a column that nothing depends on solvable.
            for (std::size_t l = 0; l < W; ++l) sum[l] = i == j ? A[j * n + j] * (1.0 + factors[l]) + 1e-300 : A[i * n + j];
            for (std::size_t k = 0; k < j; ++k) {
                const double *const x = at(i, k), *const y = at(j, k);
                for (std::size_t l = 0; l < W; ++l) sum[l] -= x[l] * y[l];
            }
            double* const out = at(i, j);
            const double* const inverse = at(j, j);
            if (i == j) {
                for (std::size_t l = 0; l < W; ++l) {
                    sound[l] = sum[l] > 0.0 ? sound[l] : 0.0;
                    out[l] = 1.0 / std::sqrt(sum[l] > 0.0 ? sum[l] : 1.0);
                }
            } else {
                for (std::size_t l = 0; l < W; ++l) out[l] = sum[l] * inverse[l];
            }
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        double* const x = s.data() + i * W;
        for (std::size_t l = 0; l < W; ++l) x[l] = b[i];
        for (std::size_t k = 0; k < i; ++k)
            for (std::size_t l = 0; l < W; ++l) x[l] -= at(i, k)[l] * s[k * W + l];
        for (std::size_t l = 0; l < W; ++l) x[l] *= at(i, i)[l];
    }
    for (std::size_t i = n; i-- > 0;) {
        double* const x = s.data() + i * W;
        for (std::size_t k = i + 1; k < n; ++k)
            for (std::size_t l = 0; l < W; ++l) x[l] -= at(k, i)[l] * s[k * W + l];
        for (std::size_t l = 0; l < W; ++l) x[l] *= at(i, i)[l];
    }
    for (std::size_t i = 0; i < n * W; ++i)
        if (sound[i % W] == 0.0) s[i] = 0.0;
}

}  // namespace gaident
