// The kernel that a loop needs: one difference equation for the whole loop where it is linear, controller and plant apart where
// the controller's limits act. `straight`: of a mixed command, otherwise null.
#pragma once

#include "kernels/kernels.hpp"

namespace gaident {

// sums[lane] = sum over n samples of (output - y)^2; the group goes on from where it stands.
inline void advance_errors(const Kernels& kernels, const Loop& loop, const ControllerState<double>& controller,
                           DoubleGroup& group, const double* input, const double* straight, const double* output, std::size_t n,
                           double* sums) {
    if (straight != nullptr) kernels.in_double.both_errors(&group, DoubleGroup::width, input, straight, output, n, sums);
    else if (loop.limited()) kernels.in_double.stepped_errors(group, controller, input, output, n, sums);
    else kernels.in_double.errors(group, input, output, n, sums);
}

// y[sample][lane]
inline void advance_outputs(const Kernels& kernels, const Loop& loop, const ControllerState<double>& controller,
                            DoubleGroup& group, const double* input, const double* straight, std::size_t n, double* y) {
    if (straight != nullptr) kernels.in_double.both_outputs(group, input, straight, n, y);
    else if (loop.limited()) kernels.in_double.stepped_outputs(group, controller, input, n, y);
    else kernels.in_double.outputs(group, input, n, y);
}

}  // namespace gaident
