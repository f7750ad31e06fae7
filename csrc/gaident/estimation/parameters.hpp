// The parameters of the local fit: a model as a vector of real numbers, and back.
//
//     x = [ln K | e1, e0 of each pole pair | single pole | e1, e0 of each zero pair | single zero | start states]
//
// The coefficients of a pair s^2 + e1 s + e0 pass smoothly from complex to real roots, which the roots themselves do not.
#pragma once

#include "../plant/ranges.hpp"
#include "../plant/roots.hpp"

#include <span>
#include <vector>

namespace gaident {

std::vector<double> pack(const Factors<double>& g, const std::vector<double>& starts);
Factors<double> unpack(std::span<const double> x, Structure s);

// Moves gain and roots that left the search ranges to the nearest end.
void project(std::span<double> x, Structure s, const SearchRanges& ranges);

// Which parameters stand at an end of their range: a pair's e1 stands for its real part (or its faster real root), its e0 for the
// imaginary part (or its slower real root). One entry per parameter of the model.
std::vector<bool> at_bounds(std::span<const double> x, Structure s, const SearchRanges& ranges);

// Step of the forward difference for parameter i: 1e-6 of its natural size, and never below that of a root at `slowest` [rad/s].
double step_size(std::span<const double> x, Structure s, double slowest, std::size_t i);

}  // namespace gaident
