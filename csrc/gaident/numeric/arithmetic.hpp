// What a number must do so that the recurrences can be run in it: add, subtract, multiply, divide, multiply and add in one (fused.hpp),
// start from a double, and be clamped. double and float are here; SIMD lanes are in lanes.hpp.
// A fixed-point or DSP number joins by providing the same operations; nothing in the recurrences asks for more.
#pragma once

#include "fused.hpp"

#include <concepts>

namespace gaident {

template <class R>
concept Arithmetic = requires(R a, R b, double d) {
    { a + b } -> std::same_as<R>;
    { a - b } -> std::same_as<R>;
    { a * b } -> std::same_as<R>;
    { a / b } -> std::same_as<R>;
    { -a } -> std::same_as<R>;
    { fma(a, b, b) } -> std::same_as<R>;   // a b + b
    { fnma(a, b, b) } -> std::same_as<R>;  // b - a b
    R(d);
    { clamp(a, b, b) } -> std::same_as<R>;
} || std::same_as<R, double> || std::same_as<R, float>;

constexpr double clamp(double x, double lo, double hi) { return x < lo ? lo : (x > hi ? hi : x); }
constexpr float clamp(float x, float lo, float hi) { return x < lo ? lo : (x > hi ? hi : x); }

}  // namespace gaident
