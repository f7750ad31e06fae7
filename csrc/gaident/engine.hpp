// The genetic search. A generation reads like the paper: evaluate, select, cross, mutate. Threads live here and nowhere else.
#pragma once

#include "operators.hpp"
#include "settings.hpp"

#include <functional>

namespace gaident {

// One population under one genome. All memory is taken in the constructor; generation() takes none.
class Breeder {
public:
    Breeder(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random);

    // Individuals [first, first + count) as a mating group whose structure bits may be fixed.
    struct Group {
        std::size_t first;
        std::uint32_t count;
        int elites;
        bool fixed_structure;
    };

    void randomise(std::size_t first, std::size_t count);
    void set_structure(std::size_t first, std::size_t count, Structure s);
    void evaluate();
    void breed(std::span<const Group> groups);
    void generation(std::span<const Group> groups) {
        breed(groups);
        evaluate();
    }

    std::size_t best_of(std::size_t first, std::size_t count) const;
    Word* operator[](std::size_t i) { return now_[i]; }
    const Population& population() const { return now_; }
    double cost(std::size_t i) const { return costs_[i]; }
    Factors<double> candidate(std::size_t i) const { return candidates_[i]; }
    std::size_t evaluations() const { return evaluations_; }

private:
    const Genome& genome_;
    Settings settings_;
    Random random_;
    Mutation mutation_;
    Batch batch_;
    Population now_, next_;
    std::vector<Factors<double>> candidates_;
    std::vector<double> costs_;
    std::vector<std::size_t> ranking_;
    std::vector<Word> spare_;  // the second child when a group's size is odd
    std::size_t evaluations_ = 0;
};

// Runs `trials` independent searches, on up to `workers` threads. The result depends on the seed alone.
std::vector<Trial> search(const Experiment& experiment, const SearchRanges& ranges, const Settings& settings, int trials,
                          std::uint64_t seed, int workers, Progress& progress);

// Calls work(0) ... work(n-1) on up to `workers` threads; the first exception is thrown again here.
void parallel(std::size_t n, int workers, const std::function<void(std::size_t)>& work);

}  // namespace gaident
