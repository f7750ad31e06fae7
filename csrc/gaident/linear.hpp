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
inline bool solve_spd(std::vector<double>& A, std::vector<double>& b, std::size_t n) {
    for (std::size_t j = 0; j < n; ++j) {
        double d = A[j * n + j];
        for (std::size_t k = 0; k < j; ++k) d -= A[j * n + k] * A[j * n + k];
        if (!(d > 0.0)) return false;
        const double root = std::sqrt(d);
        A[j * n + j] = root;
        for (std::size_t i = j + 1; i < n; ++i) {
            double s = A[i * n + j];
            for (std::size_t k = 0; k < j; ++k) s -= A[i * n + k] * A[j * n + k];
            A[i * n + j] = s / root;
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t k = 0; k < i; ++k) b[i] -= A[i * n + k] * b[k];
        b[i] /= A[i * n + i];
    }
    for (std::size_t i = n; i-- > 0;) {
        for (std::size_t k = i + 1; k < n; ++k) b[i] -= A[k * n + i] * b[k];
        b[i] /= A[i * n + i];
    }
    return true;
}

}  // namespace gaident
