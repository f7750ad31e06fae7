// What the genetic operators have to know of a chromosome: where its fields begin, and which bits say its species.
#pragma once

#include "chromosome.hpp"

#include <span>

namespace gaident {

struct Layout {
    int bits = 0;          // of a chromosome
    int species_bits = 0;  // the first so many say which species it is of; 0 where all are of one
    // A one at the first bit of every field, words() of them: where crossover starts afresh. Borrowed.
    std::span<const Word> starts;

    int words() const { return words_for(bits); }
};

}  // namespace gaident
