// A population and its generations. A generation reads like the paper: evaluate, select, cross, mutate.
#pragma once

#include "../genetic/operators.hpp"
#include "settings.hpp"

namespace gaident {

// One population. All memory is taken in the constructor; generation() takes none.
class Breeder {
public:
    Breeder(const Objective& objective, const Settings& settings, Random random, WordStream::Fill words = mixed_words);

    // Individuals [first, first + count) as a mating group whose species bits may be fixed.
    struct Group {
        std::size_t first;
        std::uint32_t count;
        int elites;
        bool one_species;
    };

    void randomise(std::size_t first, std::size_t count);
    void evaluate();
    // The order in which random words are drawn is part of the definition: group by group, first for every two children the
    // mother's tournament, the father's, the chance of crossover and its cuts; then the mutations of all the group's children in
    // one piece.
    void breed(std::span<const Group> groups);
    void generation(std::span<const Group> groups) {
        breed(groups);
        evaluate();
    }

    std::size_t best_of(std::size_t first, std::size_t count) const;
    Word* operator[](std::size_t i) { return now_[i]; }
    const Word* operator[](std::size_t i) const { return now_[i]; }
    const Population& population() const { return now_; }
    double cost(std::size_t i) const { return costs_[i]; }
    std::size_t evaluations() const { return evaluations_; }
    std::size_t overflows() const { return evaluator_->overflows(); }

private:
    Layout layout_;
    Settings settings_;
    WordStream random_;
    Mutation mutation_;
    std::unique_ptr<Evaluator> evaluator_;
    Population now_, next_;
    std::vector<double> costs_;
    std::vector<std::size_t> ranking_;
    std::vector<Word> spare_;  // the second child when a group's size is odd
    std::size_t evaluations_ = 0;
};

}  // namespace gaident
