// The velocity loop as the objective of a search: how well a plant, simulated in its loop, gives the measured velocity of the
// records, and the measured frequency responses.
//
//     cost = fitness (equation 6) for the genetic search, the sum of squared errors for the local fit
//
// A species is a structure (p, q); the level is the number of poles.
#pragma once

#include "../estimation/refine.hpp"
#include "settings.hpp"

namespace gaident {

// Samples, evenly spaced, from which the noise of a record is estimated.
inline constexpr std::size_t noise_samples = 4096;

// Structures allowed by the ranges, by p + q, then by q.
std::vector<Structure> structures(const SearchRanges& ranges);
// Those, and all smaller ones that lead to them.
SearchRanges with_smaller(SearchRanges ranges);

class VelocityObjective final : public SpeciesObjective<Refined> {
public:
    // Species that are not asked for: none, or the smaller structures that lead to those in the ranges.
    // The experiment is borrowed.
    enum class Smaller : bool { left_out, searched };

    VelocityObjective(const Experiment& experiment, const SearchRanges& ranges, const PlantCoding& coding,
                      Smaller smaller = Smaller::left_out);
    VelocityObjective(const VelocityObjective&) = delete;

    Layout layout() const override { return genome_.layout(); }
    std::unique_ptr<Evaluator> evaluator(std::size_t capacity) const override;

    std::span<const Species> species() const override { return species_; }
    void set_species(Word* c, std::size_t species) const override {
        genome_.set_structure(c, structures_[species].p, structures_[species].q);
    }
    bool leads_to(std::size_t small, std::size_t large) const override;
    Refined start(const Word* c) const override { return at_rest_or_steady(factors(c)); }
    std::vector<Refined> enlarged(const Refined& from, std::size_t to, std::size_t count) const override;
    Refined reduced(const Refined& from, std::size_t to) const override;
    Refined improved(const Refined& from, int iterations) const override { return refiner_.go_on(from, iterations); }
    double least_expected() const override { return noise_; }
    bool is_long() const override { return experiment_.is_long(); }

    const Genome& genome() const { return genome_; }
    Structure structure(std::size_t species) const { return structures_[species]; }
    Factors<double> factors(const Word* c) const;

private:
    Refined at_rest_or_steady(const Factors<double>& g) const;

    const Experiment& experiment_;
    PlantCoding coding_;
    Genome genome_;
    std::vector<Structure> structures_;
    std::vector<Species> species_;
    Refiner refiner_;
    double slowest_ = 1e300, fastest_ = 0.0;  // [rad/s] where a module can still be seen
    double noise_ = 0.0;                      // [rad^2/s^2] error sum that the noise of what was measured alone makes
};

}  // namespace gaident
