#include "island.hpp"

#include <algorithm>

namespace gaident {

namespace {

Settings with_room(Settings s, std::size_t species) {
    s.population = std::max(s.population, static_cast<int>(3 * species));
    return s;
}

}  // namespace

Island::Island(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random,
               std::span<const Structure> species)
    : genome_(genome),
      settings_(with_room(settings, species.size())),
      species_(species.begin(), species.end()),
      breeder_(experiment, genome_, settings_, random),
      best_(static_cast<std::size_t>(genome.words())) {
    const std::size_t n = static_cast<std::size_t>(settings_.population), share = n / species.size(), extra = n % species.size();
    std::size_t first = 0;
    for (std::size_t i = 0; i < species.size(); ++i) {
        const std::size_t count = share + (i < extra ? 1 : 0);
        groups_.push_back({first, static_cast<std::uint32_t>(count), 1, true});
        first += count;
    }
}

void Island::breed(int generations, const std::function<void(double)>& on_generation) {
    const auto n = static_cast<std::size_t>(settings_.population);
    history_.clear();
    breeder_.randomise(0, n);
    for (std::size_t i = 0; i < species_.size(); ++i) breeder_.set_structure(groups_[i].first, groups_[i].count, species_[i]);
    breeder_.evaluate();
    for (int g = 0;; ++g) {
        const std::size_t best = breeder_.best_of(0, n);
        history_.push_back(breeder_.cost(best));
        if (g == 0 || breeder_.cost(best) < history_[best_generation_]) {
            best_generation_ = static_cast<std::size_t>(g);
            std::copy(breeder_[best], breeder_[best] + genome_.words(), best_.begin());
        }
        on_generation(breeder_.cost(best));
        if (g + 1 == generations) return;
        breeder_.generation(groups_);
    }
}

}  // namespace gaident
