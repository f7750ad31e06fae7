// The sum of squared errors of a candidate over the records.
#pragma once

#include <limits>

namespace gaident {

// That of a candidate that diverges: the worst, and never NaN, so it cannot spoil a run.
inline constexpr double worst_error_sum = std::numeric_limits<double>::max();

inline double sane(double error_sum) { return error_sum < worst_error_sum ? error_sum : worst_error_sum; }

}  // namespace gaident
