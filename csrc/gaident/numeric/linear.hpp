// The little linear algebra the local fit needs.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace gaident {

inline constexpr std::size_t damping_lanes = 8;

// Levenberg-Marquardt steps for eight damping factors at once, one per lane:
//
//     (A + factor diag(A)) s = b,   A symmetric positive definite, n x n row-major
//
// by Cholesky, which runs the same operations in every lane.
// `s` is [i][lane]; a lane whose matrix is not positive definite gets zeros. `work` is memory, kept between calls.
void solve_damped(std::span<const double> A, std::span<const double> b, const double (&factors)[damping_lanes],
                  std::vector<double>& work, std::span<double> s);

}  // namespace gaident
