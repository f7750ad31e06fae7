// The parts of a controller's replay on a measured velocity that need a loop over samples; they work in place.
#pragma once

#include "controller.hpp"
#include "slope_limit.hpp"

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
    for (double& r : command) r = before = follow(step, r, before);
}

// How a controller keeps its integrator from winding up at the torque limit: held; held where the error would drive it further;
// set back to what the limited torque leaves of it.
enum class Hold { held, held_back, tracked };

// e(n) -> u(n) of a PI with the torque limit U: I' = clamp(I(n-1) + newest e(n) + before e(n-1), +-clamp), v = kp e(n) + I',
// u(n) = clamp(v, +-U); I(n) = I', but where |v| > U as the rule says: I(n-1), I(n-1) where e(n) v > 0, u(n) - kp e(n)
// This is no second copy of Servo (servo.hpp), with which a loop is simulated.
// Only the integral is the same: newest and before are ki T times the shares that Servo gives the two errors.
// The rules are those that a log is searched for: held has no counterpart in Servo;
// held_back issues the limit itself, where Servo forms u again with the integral that was held, which may stay below the limit;
// tracked is Servo's tracking at Tt = T only.
inline void held_torque(std::span<double> error, const Controller& c, double newest, double before, Hold rule, double integral) {
    double last = 0.0;
    for (double& x : error) {
        const double e = x, next = clamp(integral + (newest * e + before * last), -c.integrator_limit, c.integrator_limit);
        const double v = c.kp * e + next, u = clamp(v, -c.torque_limit, c.torque_limit);
        if (u == v || (rule == Hold::held_back && e * v <= 0.0)) integral = next;
        else if (rule == Hold::tracked) integral = u - c.kp * e;
        last = e;
        x = u;
    }
}

}  // namespace gaident
