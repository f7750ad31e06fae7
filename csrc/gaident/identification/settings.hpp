// What an identification of a plant by the genetic search is told.
#pragma once

#include "../genetic/genome.hpp"
#include "../search/settings.hpp"
#include "../simulation/fitness.hpp"

namespace gaident {

static_assert(worst_fitness == worst_cost);

// How a plant is coded and judged.
struct PlantCoding {
    Code code = Code::binary;
    Scale roots = Scale::linear;
    FitnessWeights weights;
    bool in_float = false;
    std::string mirror;  // name of a drive's arithmetic (target/mirror.hpp) to evaluate in; empty: none
};

struct PlantSettings : Settings, PlantCoding {
    bool species = false;  // one species per structure, local fits, comparison left to the caller; otherwise the paper's run
};

}  // namespace gaident
