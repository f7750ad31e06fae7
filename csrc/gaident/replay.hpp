// What of a controller's replay on a measured velocity only one sample after the other gives. In place.
#pragma once

#include "effects/command_rate_limit.hpp"

#include <span>

namespace gaident {

// I(n) = I(n-1) + step(n), clamped to +-limit after each update, from I(-1) = start
inline void clamped_sum(std::span<double> step, double limit, double start) {
    double I = start;
    for (double& x : step) x = I = clamp(I + x, -limit, limit);
}

// r'(n) = r'(n-1) + clip(r(n) - r'(n-1), +-step), from r'(-1) = start
inline void rate_limited(std::span<double> command, double step, double start) {
    double before = start;
    for (double& r : command) r = before = CommandRateLimit::follow(step, r, before);
}

}  // namespace gaident
