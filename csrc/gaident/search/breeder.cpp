#include "breeder.hpp"

#include <algorithm>
#include <numeric>

namespace gaident {

Breeder::Breeder(const Objective& objective, const Settings& settings, Random random, WordStream::Fill words)
    : layout_(objective.layout()),
      settings_(settings),
      random_(random, words),
      mutation_(settings.mutation, random_),
      evaluator_(objective.evaluator(static_cast<std::size_t>(settings.population))),
      now_(static_cast<std::size_t>(settings.population), layout_.words()),
      next_(now_),
      costs_(now_.size(), worst_cost),
      ranking_(now_.size()),
      spare_(static_cast<std::size_t>(layout_.words())) {}

void Breeder::randomise(std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i)
        for (int w = 0; w < now_.words(); ++w) now_[i][w] = random_.word();
}

void Breeder::evaluate() {
    evaluations_ += now_.size();
    evaluator_->evaluate(now_, costs_);
}

std::size_t Breeder::best_of(std::size_t first, std::size_t count) const {
    std::size_t best = first;
    for (std::size_t i = first + 1; i < first + count; ++i)
        if (costs_[i] < costs_[best]) best = i;
    return best;
}

void Breeder::breed(std::span<const Group> groups) {
    const int words = now_.words();
    const auto copy = [&](const Word* from, Word* to) { std::copy(from, from + words, to); };
    const Word cross_below = threshold(settings_.crossover);
    for (const Group& g : groups) {
        const auto elites = std::min(static_cast<std::size_t>(g.elites), static_cast<std::size_t>(g.count));
        if (elites > 0) {
            std::iota(ranking_.begin(), ranking_.begin() + g.count, g.first);
            std::partial_sort(
                ranking_.begin(), ranking_.begin() + static_cast<std::ptrdiff_t>(elites), ranking_.begin() + g.count,
                [&](std::size_t i, std::size_t j) { return costs_[i] < costs_[j] || (costs_[i] == costs_[j] && i < j); });
            for (std::size_t k = 0; k < elites; ++k) copy(now_[ranking_[k]], next_[g.first + k]);
        }
        const Mating mating{g.first, g.count, settings_.tournament, cross_below};
        mate(random_, mating, layout_.starts.data(), words, now_[0], costs_.data(), elites, next_[0], spare_.data());
        // Parents of one species carry the same species bits, so only mutation could change them.
        const int first_bit = g.one_species ? layout_.species_bits : 0;
        mutation_.apply(random_, next_[g.first + elites], words, g.count - elites, first_bit, layout_.bits);
    }
    now_.swap(next_);
}

}  // namespace gaident
