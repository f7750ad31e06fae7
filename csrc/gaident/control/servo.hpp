// The controller of a servo axis, at its own clock T:
//
//     position command -> kv (q* - q) + feedforward -> command filters -> velocity command r (the effects' rate limit acts on it)
//     measured velocity -> velocity filters -> w,   e = r - w
//     I(n) = clamp(I(n-1) + ki T (newest e(n) + (1 - newest) e(n-1)), +-integrator_limit),   e(-1) = 0
//     v(n) = kp (weight r - w) + I(n) + feedforward torque,   u(n) = clamp(v(n), +-torque_limit)
//     u(n) -> torque filters -> the torque that is logged, and held for T from `delay` after its sample on
//
// Where |v| is above the limit: hold: if e drives v further, I(n) = I(n-1), and v and u are formed again; tracking: I(n) += (u - v) T/Tt.
// What a log may show of other rules at the limit is replayed by held_torque (replay.hpp).
// A bare PI, weight 1 and the trapezoidal rule, is ControllerState (controller.hpp).
#pragma once

#include "controller.hpp"

namespace gaident {

// The running controller, with its state: s(n) = I(n-1) + before e(n-1) as in ControllerState, whose g is here the newest error's share.
template <class R>
struct Servo : ControllerState<R> {
    Servo(const Controller& c, const ServoSettings& settings, double period)
        : ControllerState<R>(c, Clock{period}),
          settings_(settings),
          before_(c.ki * period * (1.0 - settings.newest)),
          tracking_(settings.tracking_time > 0.0 ? period / settings.tracking_time : 0.0) {
        this->g = R(c.ki * period * settings.newest);
    }

    // As it stands in steady motion: velocity w under the command r, followed as effects let it pass, the torque u.
    void rest(R r, R followed, R w, R u) {
        integral_ = this->s = fnma(this->kp, fma(R(settings_.command_weight), followed, -w), u);
        command_.rest(settings_.command_filters, r);
        velocity_.rest(settings_.velocity_filters, w);
        torque_.rest(settings_.torque_filters, u);
        asked_ = r;
    }

    // The velocity command at sample n: of `source`, the velocity command or in a position loop the position command, with its feedforward.
    R command(std::size_t n, R source, R feedforward, R angle) {
        if (settings_.position_gain == 0.0) asked_ = source;
        else if (n % static_cast<std::size_t>(settings_.position_every) == 0)
            asked_ = fma(R(settings_.position_gain), source - angle, feedforward);
        return command_.step(settings_.command_filters, asked_);
    }

    // The torque under the velocity command r, at the measured velocity.
    R torque(R r, R measured, R feedforward) {
        const R w = velocity_.step(settings_.velocity_filters, measured), e = r - w;
        const R proportional = fma(this->kp, fma(R(settings_.command_weight), r, -w), feedforward);
        const R integral_before = integral_;
        R I = clamp(fma(this->g, e, this->s), -this->integrator_limit, this->integrator_limit);
        const R v = proportional + I;
        R u = clamp(v, -this->torque_limit, this->torque_limit);
        if (settings_.anti_windup == AntiWindup::tracking) {
            I = fma(u - v, R(tracking_), I);
        } else if (settings_.anti_windup == AntiWindup::hold) {
            // (v - u) e > 0: limited, and driven further
            I = greater((v - u) * e, R(0.0), integral_before, I);
            u = clamp(proportional + I, -this->torque_limit, this->torque_limit);
        }
        integral_ = I;
        this->s = fma(R(before_), e, I);
        return torque_.step(settings_.torque_filters, u);
    }

private:
    const ServoSettings& settings_;
    FilterMemory<R> command_, velocity_, torque_;
    double before_, tracking_;
    R integral_ = R(0.0), asked_ = R(0.0);
};

}  // namespace gaident
