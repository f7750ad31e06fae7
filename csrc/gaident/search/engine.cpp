#include "engine.hpp"

#include "../runtime/parallel.hpp"
#include "species.hpp"

#include <algorithm>

namespace gaident {

namespace {

// The paper's run: one population, every structure in it; the best candidate ever seen is reported.
Trial run_plain(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, Progress& progress) {
    Breeder breeder(experiment, genome, settings, random);
    const auto n = static_cast<std::size_t>(settings.population);
    const Breeder::Group all[] = {{0, static_cast<std::uint32_t>(n), settings.elites, false}};
    Trial trial;
    trial.history.reserve(static_cast<std::size_t>(settings.generations));
    trial.best.resize(static_cast<std::size_t>(genome.words()));
    breeder.randomise(0, n);
    breeder.evaluate();
    for (int g = 0;; ++g) {
        const std::size_t best = breeder.best_of(0, n);
        trial.history.push_back(breeder.cost(best));
        if (breeder.cost(best) < trial.best_fitness) {
            trial.best_fitness = breeder.cost(best);
            trial.best_generation = g;
            std::copy(breeder[best], breeder[best] + genome.words(), trial.best.begin());
        }
        progress.note(1, trial.best_fitness);
        if (g + 1 == settings.generations) break;
        breeder.generation(all);
    }
    trial.evaluations = breeder.evaluations();
    trial.overflows = breeder.overflows();
    return trial;
}

}  // namespace

std::vector<Trial> search(const Experiment& experiment, const SearchRanges& ranges, const Settings& settings, int trials,
                          std::uint64_t seed, int workers, Progress& progress) {
    experiment.check();
    settings.check();
    if (trials < 1) throw std::invalid_argument("trials must be at least 1");
    const bool held = experiment.loop.kind != LoopKind::continuous;
    if (held && ranges.p_min < 1)
        throw std::invalid_argument(
            "p must be at least 1 in the sampled loop and in open loop: a plant that passes its torque "
            "straight through does not exist behind a hold");
    const Genome genome(ranges, settings.code, settings.roots);
    std::vector<Trial> result(static_cast<std::size_t>(trials));
    Workers all(workers);
    Experiment shared = experiment;
    shared.workers = &all;
    all.share(result.size(), [&](std::size_t i) {
        const Random random = Random::stream(seed, i);
        result[i] = settings.species ? run_species(shared, genome, settings, random, progress)
                                     : run_plain(shared, genome, settings, random, progress);
    });
    return result;
}

}  // namespace gaident
