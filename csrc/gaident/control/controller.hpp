// The PI velocity controller and how the loop is closed.
//
//     u(n) = kp e(n) + I(n),   I(n) = I(n-1) + ki Ts (e(n) + e(n-1))/2,   e(-1) = 0, I(-1) = 0
//
// The trapezoidal integral is the bilinear transformation of ki/s, so both loops share this controller; they differ in the plant:
// bilinear with the algebraic loop solved exactly (continuous), or behind a zero-order hold (sampled).
#pragma once

#include "../plant/bilinear.hpp"

#include <cstdint>
#include <limits>

namespace gaident {

enum class LoopKind : std::uint8_t { continuous, sampled, open };

struct Loop {
    LoopKind kind = LoopKind::continuous;
    double kp = 0.0, ki = 0.0;  // [N m s/rad], [N m/rad]
    double torque_limit = std::numeric_limits<double>::infinity();
    double integrator_limit = std::numeric_limits<double>::infinity();

    bool limited() const {
        return kind != LoopKind::open && (torque_limit < std::numeric_limits<double>::infinity() ||
                                          integrator_limit < std::numeric_limits<double>::infinity());
    }
};

// The controller as a state: s(n) = I(n-1) + g e(n-1), g = ki Ts/2, so I(n) = s(n) + g e(n), s(n+1) = I(n) + g e(n).
template <class R>
struct Controller {
    R kp, g, torque_limit, integrator_limit;
    R s = R(0.0);

    Controller(const Loop& loop, double sample_time)
        : kp(R(loop.kp)),
          g(R(0.5 * loop.ki * sample_time)),
          torque_limit(R(loop.torque_limit)),
          integrator_limit(R(loop.integrator_limit)) {}

    R step(R e) {
        const R I = clamp(s + g * e, -integrator_limit, integrator_limit);
        s = I + g * e;
        return clamp(kp * e + I, -torque_limit, torque_limit);
    }
};

}  // namespace gaident
