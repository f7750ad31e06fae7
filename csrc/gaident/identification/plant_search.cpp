#include "plant_search.hpp"

#include "../search/species.hpp"

namespace gaident {

std::vector<PlantTrial> search_plant(const Experiment& experiment, const SearchRanges& ranges, const PlantSettings& settings,
                                     int trials, std::uint64_t seed, int workers, Progress& progress) {
    experiment.check();
    settings.check();
    const bool held = experiment.loop.kind != LoopKind::continuous;
    if (held && ranges.p_min < 1)
        throw std::invalid_argument(
            "p must be at least 1 in the sampled loop and in open loop: a plant that passes its torque "
            "straight through does not exist behind a hold");
    Workers all(workers);
    Experiment shared = experiment;
    shared.workers = &all;
    const Resources resources{all, progress, experiment.stop, experiment.kernels->words};
    using Smaller = VelocityObjective::Smaller;
    const VelocityObjective objective(shared, ranges, settings, settings.species ? Smaller::searched : Smaller::left_out);
    if (settings.species) return search_species<Refined>(objective, settings, trials, seed, resources);
    std::vector<PlantTrial> result;
    for (Trial& t : search(objective, settings, trials, seed, resources)) result.push_back({std::move(t), {}});
    return result;
}

Structure leading_structure(const SearchRanges& ranges, const Progress& progress) {
    const int leading = progress.leading;
    return leading < 0 ? Structure{-1, -1} : structures(with_smaller(ranges))[static_cast<std::size_t>(leading)];
}

}  // namespace gaident
