#include "breeder.hpp"

#include "chromosomes.hpp"

#include <algorithm>
#include <numeric>

namespace gaident {

Breeder::Breeder(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random)
    : genome_(genome),
      decoder_(genome),
      settings_(settings),
      random_(random, experiment.kernels->words),
      mutation_(settings.mutation, random_),
      batch_(experiment, static_cast<std::size_t>(settings.population), settings.in_float),
      mirror_(settings.mirror.empty() ? nullptr : make_mirror(settings.mirror, experiment, genome, settings.weights)),
      now_(static_cast<std::size_t>(settings.population), genome.words()),
      next_(now_),
      costs_(now_.size(), worst_fitness),
      ranking_(now_.size()),
      spare_(static_cast<std::size_t>(genome.words())) {}

void Breeder::randomise(std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i)
        for (int w = 0; w < now_.words(); ++w) now_[i][w] = random_.word();
}

void Breeder::set_structure(std::size_t first, std::size_t count, Structure s) {
    for (std::size_t i = first; i < first + count; ++i) genome_.set_structure(now_[i], s.p, s.q);
}

void Breeder::evaluate() {
    evaluations_ += now_.size();
    if (mirror_) return mirror_->evaluate(now_, costs_);
    batch_.errors(Chromosomes(now_, decoder_), costs_);
    for (std::size_t i = 0; i < now_.size(); ++i) costs_[i] = fitness(costs_[i], decoder_.structure(now_[i]), settings_.weights);
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
        mate(random_, mating, genome_.starts(), words, now_[0], costs_.data(), elites, next_[0], spare_.data());
        // Parents of one species carry the same structure bits, so only mutation could change them.
        const int first_bit = g.fixed_structure ? 2 * genome_.structure_bits() : 0;
        mutation_.apply(random_, next_[g.first + elites], words, g.count - elites, first_bit, genome_.bits());
    }
    now_.swap(next_);
}

}  // namespace gaident
