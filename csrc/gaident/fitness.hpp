// Fitness (equation 6):  F = sum_n (Wf1 (w(n) - wm(n)))^2 + Wf2 (p + q).  Smaller is better.
#pragma once

#include "factors.hpp"

#include <limits>

namespace gaident {

// What a diverged candidate gets: the worst, and never NaN, so it cannot spoil a run.
inline constexpr double worst_fitness = std::numeric_limits<double>::max();

inline double sane(double error_sum) { return error_sum < worst_fitness ? error_sum : worst_fitness; }

struct FitnessWeights {
    double error = 1.0;  // Wf1
    double order = 2.0;  // Wf2
};

inline double fitness(double error_sum, Structure s, const FitnessWeights& w) {
    if (!(error_sum < worst_fitness)) return worst_fitness;
    return sane(w.error * w.error * error_sum + w.order * static_cast<double>(s.p + s.q));
}

}  // namespace gaident
