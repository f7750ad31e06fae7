// Fitness (equation 6):  F = sum_n (Wf1 (w(n) - wm(n)))^2 + Wf2 (p + q).  Smaller is better.
#pragma once

#include "error_sum.hpp"
#include "../plant/factors.hpp"

namespace gaident {

struct FitnessWeights {
    double error = 1.0;  // Wf1
    double order = 2.0;  // Wf2
};

// What a diverged candidate gets.
inline constexpr double worst_fitness = worst_error_sum;

inline double fitness(double error_sum, Structure s, const FitnessWeights& w) {
    if (!(error_sum < worst_error_sum)) return worst_fitness;
    return sane(w.error * w.error * error_sum + w.order * static_cast<double>(s.p + s.q));
}

}  // namespace gaident
