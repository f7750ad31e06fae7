// A measured record as the core sees it: borrowed arrays, and how the loop stood when it began.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace gaident {

class ServoEquation;

enum class Start : std::uint8_t {
    rest,    // every state zero
    steady,  // constant velocity `velocity0` under constant input: what the genetic search assumes of a start in motion
    free,    // unknown: the local fit estimates the state, starting from `steady`
};

struct Record {
    std::span<const double> input;   // velocity command, or torque in open loop
    std::span<const double> output;  // measured velocity
    double sample_time = 0.0;
    Start start = Start::rest;
    double velocity0 = 0.0;
    const ServoEquation* servo = nullptr;  // of the loop LoopKind::servo, from line to line of this record
    std::span<const double> straight =
        {};  // the part of a mixed command that goes straight from line to line (plant/decimation.hpp)

    std::size_t size() const { return output.size(); }
    // Of the sample `first` and those behind it; null without a part that goes straight.
    const double* straight_from(std::size_t first) const { return straight.empty() ? nullptr : straight.data() + first; }
};

}  // namespace gaident
