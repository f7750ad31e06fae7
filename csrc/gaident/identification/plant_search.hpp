// The genetic search for a plant in its velocity loop.
#pragma once

#include "velocity_objective.hpp"

namespace gaident {

using PlantTrial = SpeciesTrial<Refined>;

// `trials` independent searches, on up to `workers` threads. The result depends on the seed alone.
std::vector<PlantTrial> search_plant(const Experiment& experiment, const SearchRanges& ranges, const PlantSettings& settings,
                                     int trials, std::uint64_t seed, int workers, Progress& progress);

// The structure that progress.leading means in a search by species over these ranges; {-1, -1}: none yet.
Structure leading_structure(const SearchRanges& ranges, const Progress& progress);

}  // namespace gaident
