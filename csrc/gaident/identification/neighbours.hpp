// Structures one module apart: a fitted optimum as a start for the next larger or smaller structure.
#pragma once

#include "../plant/ranges.hpp"
#include "../plant/roots.hpp"

#include <vector>

namespace gaident {

// Places of a module that is added, evenly spaced in the logarithm of its frequency.
inline constexpr int grid_points = 12;

// Whether `to` is `from` and one module, or one conjugate pair of modules: a pole; a pole and a zero.
bool may_grow(Structure from, Structure to);

// Candidates for structure `to` made from the fitted `from` by adding a module that nearly cancels, over a grid of frequencies
// [rad/s], one place after the other; empty where may_grow() says no.
std::vector<Factors<double>> grow(const Factors<double>& from, Structure to, const SearchRanges& ranges, double slowest,
                                  double fastest);

// Candidates for structure `to` made from the fitted `from` by taking one module away, any that there is, its gain at standstill
// kept in the gain; empty where may_grow(to, from) says no, or where the roots allow none.
std::vector<Factors<double>> shrink(const Factors<double>& from, Structure to);

}  // namespace gaident
