#include "engine.hpp"

#include <algorithm>

namespace gaident {

namespace {

Trial search_once(const Objective& objective, const Settings& settings, Random random, const Resources& resources) {
    Breeder breeder(objective, settings, random, resources.words);
    const auto n = static_cast<std::size_t>(settings.population);
    const Breeder::Group all[] = {{0, static_cast<std::uint32_t>(n), settings.elites, false}};
    Trial trial;
    trial.history.reserve(static_cast<std::size_t>(settings.generations));
    trial.best.resize(static_cast<std::size_t>(objective.layout().words()));
    breeder.randomise(0, n);
    breeder.evaluate();
    for (int g = 0;; ++g) {
        const std::size_t best = breeder.best_of(0, n);
        trial.history.push_back(breeder.cost(best));
        if (breeder.cost(best) < trial.best_fitness) {
            trial.best_fitness = breeder.cost(best);
            trial.best_generation = g;
            std::copy(breeder[best], breeder[best] + trial.best.size(), trial.best.begin());
        }
        resources.progress.note(1, trial.best_fitness);
        if (g + 1 == settings.generations) break;
        stop_if_asked(resources.stop);
        breeder.generation(all);
    }
    trial.evaluations = breeder.evaluations();
    trial.overflows = breeder.overflows();
    return trial;
}

}  // namespace

std::vector<Trial> search(const Objective& objective, const Settings& settings, int trials, std::uint64_t seed,
                          const Resources& resources) {
    return independent_trials<Trial>(settings, trials, seed, resources.workers,
                                     [&](Random random) { return search_once(objective, settings, random, resources); });
}

}  // namespace gaident
