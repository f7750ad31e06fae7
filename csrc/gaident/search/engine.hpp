// The genetic search: independent trials of the paper's run, or of the search by species (species.hpp).
#pragma once

#include "breeder.hpp"

namespace gaident {

// The paper's run, `trials` times: one population, every species in it; the best candidate ever seen is reported.
// The result depends on the seed alone.
// Throws std::invalid_argument for settings or trials out of their range, Stopped where that is asked for.
std::vector<Trial> search(const Objective& objective, const Settings& settings, int trials, std::uint64_t seed,
                          const Resources& resources);

// Trial i draws its random words from stream i of the seed.
template <class Result, class Search>
std::vector<Result> independent_trials(const Settings& settings, int trials, std::uint64_t seed, Workers& workers,
                                       const Search& search_once) {
    settings.check();
    if (trials < 1) throw std::invalid_argument("trials must be at least 1");
    std::vector<Result> result(static_cast<std::size_t>(trials));
    workers.share(result.size(), [&](std::size_t i) { result[i] = search_once(Random::stream(seed, i)); });
    return result;
}

}  // namespace gaident
