// What the controller of a servo axis has beyond a bare PI; servo.hpp says what it does.
#pragma once

#include "digital_filter.hpp"

#include <cstdint>

namespace gaident {

enum class AntiWindup : std::uint8_t { none, hold, tracking };

// What a servo axis has beyond a bare PI.
struct ServoSettings {
    double newest = 0.5;          // share of ki T that e(n) has in the step of I(n): 0.5 trapezoidal, 1 backward, 0 forward
    double command_weight = 1.0;  // 0: an IP controller
    AntiWindup anti_windup = AntiWindup::none;
    double tracking_time = 0.0;  // [s] Tt
    FilterChain command_filters, velocity_filters, torque_filters;
    double position_gain = 0.0;  // [1/s] kv; 0: no position loop
    int position_every = 1;      // velocity controller's samples from one position controller's to the next
    double delay = 0.0;          // [s] from a sample to its torque at the motor
    bool differenced = false;    // the velocity that it reads is the difference of an encoder's angle over its sample
};

}  // namespace gaident
