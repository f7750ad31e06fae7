// The PI velocity controller and how the loop is closed.
//
//     u(n) = kp e(n) + I(n),   I(n) = I(n-1) + ki Ts (e(n) + e(n-1))/2,   e(-1) = 0, I(-1) = 0
//
// The trapezoidal integral is the bilinear transformation of ki/s, so both loops share this controller; they differ in the plant:
// bilinear with the algebraic loop solved exactly (continuous), or behind a zero-order hold (sampled).
// What a servo axis has beyond that PI (servo.hpp) is behind a zero-order hold as well.
#pragma once

#include "../plant/bilinear.hpp"
#include "clock.hpp"
#include "servo_settings.hpp"

#include <cstdint>
#include <limits>

namespace gaident {

enum class LoopKind : std::uint8_t { continuous, sampled, servo, open };

// The controller's settings.
struct Controller {
    double kp = 0.0, ki = 0.0;                                          // [N m s/rad], [N m/rad]
    double torque_limit = std::numeric_limits<double>::infinity();      // [N m], of abs(u)
    double integrator_limit = std::numeric_limits<double>::infinity();  // [N m], of abs(I)

    bool limited() const {
        return torque_limit < std::numeric_limits<double>::infinity() ||
               integrator_limit < std::numeric_limits<double>::infinity();
    }
};

// How the loop is closed, and over which controller; in the open loop there is none.
struct Loop {
    LoopKind kind = LoopKind::continuous;
    Controller controller;
    ServoSettings servo = {};  // of LoopKind::servo

    bool limited() const { return kind != LoopKind::open && controller.limited(); }
};

// The running controller, with its state: s(n) = I(n-1) + g e(n-1), g = ki Ts/2, so I(n) = s(n) + g e(n), s(n+1) = I(n) + g e(n).
template <class R>
struct ControllerState {
    R kp, g, torque_limit, integrator_limit;
    R s = R(0.0);

    ControllerState(const Controller& c, const Clock& clock)
        : kp(R(c.kp)),
          g(R(0.5 * c.ki * clock.period)),
          torque_limit(R(c.torque_limit)),
          integrator_limit(R(c.integrator_limit)) {}

    R step(R e) {
        const R I = clamp(fma(g, e, s), -integrator_limit, integrator_limit);
        s = fma(g, e, I);
        return clamp(fma(kp, e, I), -torque_limit, torque_limit);
    }
};

}  // namespace gaident
