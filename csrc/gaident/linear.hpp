// The little linear algebra the local fit needs.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace gaident {

// Sum of products with eight running sums, so that it vectorises and its rounding is the same everywhere.
inline double dot(const double* x, const double* y, std::size_t n) {
    std::array<double, 8> part{};
    std::size_t i = 0;
    for (; i + 8 <= n; i += 8)
        for (std::size_t k = 0; k < 8; ++k) part[k] += x[i + k] * y[i + k];
    double sum = 0.0;
    for (; i < n; ++i) sum += x[i] * y[i];
    return sum + (((part[0] + part[4]) + (part[2] + part[6])) + ((part[1] + part[5]) + (part[3] + part[7])));
}

// Solves A x = b for symmetric positive definite A (row-major n x n, destroyed) by Cholesky; false where A is not.
bool solve_spd(std::vector<double>& A, std::vector<double>& b, std::size_t n);

}  // namespace gaident
