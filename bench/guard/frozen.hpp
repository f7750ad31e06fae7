// FROZEN. The yardstick of the regression guard: one candidate at a time, plain scalar code, compiled with fixed flags. Never to be
// improved, vectorised, tuned or shared with the core: what it is worth is that it stays as slow as it is. A change here
// makes every ratio in ratios.txt meaningless.
#pragma once

#include <cstddef>

namespace frozen {

// sum over n samples of (output - y)^2 of the delta-form recurrence of order N <= 8, from rest:
//     y = x[0] + b[0] r,   x[i] += x[i+1] + b[i+1] r - a[i] y,   x[N] = 0;   a holds N numbers, b N + 1
double error_sum(int N, const double* a, const double* b, const double* input, const double* output, std::size_t n);

}  // namespace frozen
