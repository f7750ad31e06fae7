// The genetic search: independent trials of the paper's run or of the species engine.
#pragma once

#include "breeder.hpp"

namespace gaident {

// Runs `trials` independent searches, on up to `workers` threads. The result depends on the seed alone.
std::vector<Trial> search(const Experiment& experiment, const SearchRanges& ranges, const Settings& settings, int trials,
                          std::uint64_t seed, int workers, Progress& progress);

}  // namespace gaident
