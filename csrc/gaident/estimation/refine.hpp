// The local fit: Levenberg-Marquardt on the simulation error, started from a candidate.
//
//     minimise  J(x) = sum_records sum_n v(n)^2,   v = the error e = w - wm, or e filtered by 1 - sum phi_i z^-i
//
// over the parameters x of parameters.hpp and the start states of records that do not begin at rest.
// Derivatives are forward differences, one parameter per lane (sweep.hpp); eight damping factors are tried at once, one per lane.
#pragma once

#include "../plant/ranges.hpp"
#include "sweep.hpp"

namespace gaident {

struct RefineOptions {
    SearchRanges ranges;
    bool bounded = true;            // keep roots and gain inside the ranges
    std::vector<double> whitening;  // phi; empty: the plain error
    double tolerance = 1e-9;        // relative fall of J, twice in a row, at which it stops
};

struct Refined {
    Factors<double> factors;
    std::vector<double> starts;  // start_states() numbers per record with Start::free, in record order
    double cost = worst_error_sum;
    double damping = 1e-2;  // where a fit that goes on begins
    int iterations = 0;
    bool converged = false;
    std::vector<bool> at_bound;  // per parameter of x, starts excluded
};

class Refiner {
public:
    Refiner(const Experiment& experiment, RefineOptions options) : experiment_(experiment), options_(std::move(options)) {}

    // `starts` may be empty: then steady motion at each record's velocity0.
    Refined fit(const Factors<double>& g, const std::vector<double>& starts, int max_iterations) const;
    // Up to so many iterations more.
    Refined go_on(const Refined& from, int max_iterations) const;

    // J at many points at once.
    std::vector<double> costs(std::span<const Factors<double>> candidates) const;

    // Error v and its derivatives dv/dx, column by column, over all records.
    // `columns` is parameters x samples: for records that leave room for that; statistics.hpp gathers what a covariance needs
    // without.
    void sensitivities(const Factors<double>& g, const std::vector<double>& starts, std::vector<double>& error,
                       std::vector<double>& columns) const;

    int parameters(Structure s) const { return static_cast<int>(Unknowns(experiment_, s).count); }

private:
    const Experiment& experiment_;
    RefineOptions options_;
};

}  // namespace gaident
