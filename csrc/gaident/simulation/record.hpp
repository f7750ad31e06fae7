// A measured record as the core sees it: borrowed arrays, and how the loop stood when it began.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace gaident {

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

    std::size_t size() const { return output.size(); }
};

}  // namespace gaident
