// A population and its generations. A generation reads like the paper: evaluate, select, cross, mutate.
#pragma once

#include "../genetic/decoder.hpp"
#include "../target/mirror.hpp"
#include "../genetic/operators.hpp"
#include "settings.hpp"

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
    // The order in which random words are drawn is part of the definition: group by group, first for every two children the mother's
    // tournament, the father's, the chance of crossover and its cuts; then the mutations of all the group's children in one piece.
    void breed(std::span<const Group> groups);
    void generation(std::span<const Group> groups) {
        breed(groups);
        evaluate();
    }

    std::size_t best_of(std::size_t first, std::size_t count) const;
    Word* operator[](std::size_t i) { return now_[i]; }
    const Population& population() const { return now_; }
    double cost(std::size_t i) const { return costs_[i]; }
    Factors<double> candidate(std::size_t i) const { return decode(now_[i], genome_); }
    std::size_t evaluations() const { return evaluations_; }
    std::size_t overflows() const { return mirror_ ? mirror_->overflows() : 0; }

private:
    const Genome& genome_;
    Decoder decoder_;
    Settings settings_;
    WordStream random_;
    Mutation mutation_;
    Batch batch_;
    std::unique_ptr<Mirror> mirror_;  // instead of the batch, where a drive's arithmetic is asked for
    Population now_, next_;
    std::vector<double> costs_;
    std::vector<std::size_t> ranking_;
    std::vector<Word> spare_;  // the second child when a group's size is odd
    std::size_t evaluations_ = 0;
};

}  // namespace gaident
