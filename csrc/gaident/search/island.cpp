#include "island.hpp"

#include <algorithm>

namespace gaident {

namespace {

Settings with_room(Settings s, std::size_t species) {
    s.population = std::max(s.population, static_cast<int>(3 * species));
    return s;
}

}  // namespace

Island::Island(const Objective& objective, const SetSpecies& set_species, const Settings& settings, Random random,
               const Resources& resources, std::span<const std::size_t> species)
    : set_species_(set_species),
      settings_(with_room(settings, species.size())),
      stop_(resources.stop),
      species_(species.begin(), species.end()),
      breeder_(objective, settings_, random, resources.words),
      best_(static_cast<std::size_t>(objective.layout().words())) {
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
    for (std::size_t k = 0; k < species_.size(); ++k)
        for (std::size_t i = 0; i < groups_[k].count; ++i) set_species_(breeder_[groups_[k].first + i], species_[k]);
    breeder_.evaluate();
    for (int g = 0;; ++g) {
        const std::size_t best = breeder_.best_of(0, n);
        history_.push_back(breeder_.cost(best));
        if (g == 0 || breeder_.cost(best) < history_[best_generation_]) {
            best_generation_ = static_cast<std::size_t>(g);
            std::copy(breeder_[best], breeder_[best] + best_.size(), best_.begin());
        }
        on_generation(breeder_.cost(best));
        if (g + 1 == generations) return;
        stop_if_asked(stop_);
        breeder_.generation(groups_);
    }
}

}  // namespace gaident
