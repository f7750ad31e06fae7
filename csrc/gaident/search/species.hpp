// The default engine: one species per structure, so that no structure is lost before its parameters are any good (docs/identification.md).
//
// In rounds: some generations of the genetic search inside each species, then a local fit of each species' best. From small
// structures to large, a fitted structure also lends its optimum to the larger ones (neighbours.hpp), and the leader in the end to the
// smaller ones. A first round is quick. Where it leaves more error than the noise of the measured velocity, rounds with many more
// starts follow until one finds no better optimum close to the best. Smaller structures are fitted even where they are not asked for, as
// starts of those that are.
// Structures are not compared here.
#pragma once

#include "breeder.hpp"

namespace gaident {

Trial run_species(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random,
                  Progress& progress);

// Structures allowed by the ranges, by p + q, then by q.
std::vector<Structure> structures(const SearchRanges& ranges);

}  // namespace gaident
