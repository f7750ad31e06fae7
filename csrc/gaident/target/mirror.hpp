// A search on the host in the arithmetic of a drive: genes, coefficients, recurrence and fitness all in it, by the same
// templates (candidate.hpp), so that the run is that of static_search.hpp bit for bit.
// Costs come back as doubles, which contain every number of every arithmetic.
#pragma once

#include "../simulation/fitness.hpp"
#include "../genetic/genome.hpp"
#include "../genetic/population.hpp"
#include "../simulation/batch.hpp"

#include <memory>
#include <string_view>

namespace gaident {

class Mirror {
public:
    virtual ~Mirror() = default;
    // Equation (6) of every individual.
    virtual void evaluate(const Population& all, std::span<double> costs) = 0;
    // Individuals so far whose response left the arithmetic's range, or diverged: their cost is the worst.
    std::size_t overflows() const { return overflows_; }

protected:
    std::size_t overflows_ = 0;
};

// By name; throws std::invalid_argument for a name that is none, and for loops that a drive's search does not know: only the
// continuous one, without limits.
std::unique_ptr<Mirror> make_mirror(std::string_view arithmetic, const Experiment& experiment, const Genome& genome,
                                    const FitnessWeights& weights);

// The names: "drive_double", "drive_float", "c30", "fixed", ...
std::vector<std::string_view> mirror_names();

// One model's velocity in such an arithmetic; `in_z`: not in delta form but in powers of z, the coefficients computed in double
// and rounded once, which is more exact than in a drive.
// Returns whether it left the arithmetic's range; from there on the velocity is NaN.
// Throws Stopped soon after `stop` is set, where there is one.
bool mirror_velocity(std::string_view arithmetic, bool in_z, const Factors<double>& g, std::span<const double> input,
                     double sample_time, const Loop& loop, std::span<double> velocity, const std::atomic<bool>* stop = nullptr);

}  // namespace gaident
