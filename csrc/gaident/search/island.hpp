// Some species of a search, bred together. Species never mate with one another, so islands can run side by side.
#pragma once

#include "breeder.hpp"

#include <functional>

namespace gaident {

class Island {
public:
    // Writes the bits of a species into a chromosome: SpeciesObjective::set_species.
    using SetSpecies = std::function<void(Word*, std::size_t)>;

    // `settings.population` individuals, shared evenly, at least three per species: fewer cannot mate.
    Island(const Objective& objective, const SetSpecies& set_species, const Settings& settings, Random random,
           const Resources& resources, std::span<const std::size_t> species);
    Island(const Island&) = delete;

    // One round from fresh random individuals; `on_generation` hears the least cost of each generation.
    void breed(int generations, const std::function<void(double)>& on_generation);

    // Of the round: least cost per generation, and the chromosome of the least of all.
    const std::vector<double>& history() const { return history_; }
    const std::vector<Word>& best() const { return best_; }

    // The best individual of the k-th species as the round left it.
    const Word* best_of(std::size_t k) const { return breeder_[breeder_.best_of(groups_[k].first, groups_[k].count)]; }
    std::size_t evaluations() const { return breeder_.evaluations(); }
    std::size_t overflows() const { return breeder_.overflows(); }

private:
    SetSpecies set_species_;
    Settings settings_;
    const std::atomic<bool>* stop_;
    std::vector<std::size_t> species_;
    std::vector<Breeder::Group> groups_;
    Breeder breeder_;
    std::vector<double> history_;
    std::size_t best_generation_ = 0;
    std::vector<Word> best_;
};

}  // namespace gaident
