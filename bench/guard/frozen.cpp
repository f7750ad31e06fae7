// FROZEN, see frozen.hpp.
#include "frozen.hpp"

double frozen::error_sum(int N, const double* a, const double* b, const double* input, const double* output, std::size_t n) {
    double x[9] = {};
    double sum = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
        const double r = input[k];
        const double y = x[0] + b[0] * r;
        for (int i = 0; i < N; ++i) x[i] = ((x[i] + x[i + 1]) + b[i + 1] * r) - a[i] * y;
        const double e = output[k] - y;
        sum = sum + e * e;
    }
    return sum;
}
