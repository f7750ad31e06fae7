// Effects that the core does not know: a user's own functions of the loop's signals, asked at their places in the loop.
// Slower than the core's own by the call, and without a memory; the caller needs no knowledge of what they are.
#pragma once

#include <cstddef>
#include <limits>
#include <span>

namespace gaident {

enum class OwnPlace {
    command,         // the velocity command that the controller follows in place of the one given, rad/s
    torque,          // added to the motor's torque at the shaft, N m
    friction,        // dry friction against the motion, its level >= 0, N m
    torque_at_load,  // the same two at the load of two masses
    friction_at_load,
    actuator,  // the torque that acts in place of the one commanded, N m
    sensor,    // the velocity that the sensor shows in place of the true one, rad/s
};

// What they may ask for, lanes side by side; the arrays stay where they are for as long as a run lasts.
struct OwnSignals {
    double* velocity;   // rad/s: at the shaft that in the middle of the substep, foreseen; at the load the load's
    double* angle;      // rad; at the load the load's
    double* torque;     // N m: at the shaft and the load what saturation, dead band, delay and lag left of the command
    double* command;    // rad/s: at the command the one given, elsewhere no_command
    double time = 0.0;  // s since the record's start
};

inline constexpr double no_command = std::numeric_limits<double>::quiet_NaN();

class OwnEffects {
public:
    virtual ~OwnEffects() = default;

    virtual bool at(OwnPlace place) const = 0;
    // A run begins: lane i belongs to model models[i]. `answer`: where the answers go.
    virtual void begin(std::span<const std::size_t> models, const OwnSignals& signals, double* answer) = 0;
    // Sum over the effects there; at command, actuator and sensor each takes what the one before it gave.
    virtual void ask(OwnPlace place, double time) = 0;
};

}  // namespace gaident
