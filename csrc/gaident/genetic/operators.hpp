// The genetic operators, as functions on words.
// They do not know what the bits mean; the table hands them the first bit of every field.
// Which random words each one draws is part of its definition: the referee in reference/ draws the same words and does the same
// work bit by bit.
#pragma once

#include "chromosome.hpp"
#include "../numeric/rng.hpp"

#include <array>

namespace gaident {

// Tournament: `size` contestants drawn with replacement from [first, first + count), one word each; the lowest cost wins, the
// earlier drawn on a tie.
template <class Source, class Cost>
std::size_t tournament(Source& random, const Cost* cost, std::size_t first, std::uint32_t count, int size) {
    std::size_t winner = first + below(random.word(), count);
    for (int k = 1; k < size; ++k) {
        const std::size_t rival = first + below(random.word(), count);
        winner = cost[rival] < cost[winner] ? rival : winner;
    }
    return winner;
}

// Bit i becomes the parity of bits 0..i, counted from the most significant.
constexpr Word running_parity(Word x) {
    for (int s = 1; s < word_bits; s <<= 1) x ^= x >> s;
    return x;
}

// Multi-point crossover, each field on its own: between any two bits of a field is a cut with probability 1/4, and each field
// starts from either parent with probability 1/2.
// One child takes its bits from a until a cut, from b until the next, and so on; the other child takes the rest.
// Draws two words r1, r2 per word: cut = r1 & (r2 | start of field).
template <class Source>
void crossover(Source& random, const Word* starts, int words, const Word* a, const Word* b, Word* child_a, Word* child_b) {
    Word carried = 0;  // all ones while the segment that reaches over the word's edge comes from the other parent
    for (int w = 0; w < words; ++w) {
        const Word r1 = random.word(), r2 = random.word();
        const Word other = running_parity(r1 & (r2 | starts[w])) ^ carried;
        carried = Word{0} - (other & 1);
        const Word swap = (a[w] ^ b[w]) & other;
        child_a[w] = a[w] ^ swap;
        child_b[w] = b[w] ^ swap;
    }
}

// Bit mutation: every bit flips with probability m, independently.
// Drawn by the gaps between flips, which are geometric, P(gap >= k) = (1-m)^k: one word per flip instead of one per bit.
// The gap runs on from one chromosome to the next.
class Mutation {
public:
    template <class Source>
    Mutation(double probability, Source& random) {
        double tail = 1.0;
        for (auto& t : tails_) {
            tail *= 1.0 - probability;
            t = threshold(tail);
        }
        std::size_t k = tails_.size() - 1;
        for (std::size_t top = 0; top < first_.size(); ++top) {
            const Word largest = ((Word{top} + 1) << (word_bits - top_bits)) - 1;
            while (k > 0 && largest >= tails_[k - 1]) --k;
            first_[top] = static_cast<std::uint8_t>(k);
        }
        gap_ = draw(random);
    }

    // Flips bits of [first, last) in each of `count` chromosomes of `words` words, one after the other.
    template <class Source>
    void apply(Source& random, Word* c, int words, std::size_t count, int first, int last) {
        // 32 bits, which divide faster, contain every place in a population.
        const auto length = static_cast<std::uint32_t>(last - first);
        const std::uint64_t total = std::uint64_t{length} * count;
        std::uint64_t at = gap_;
        while (at < total) {
            const std::uint32_t chromosome = static_cast<std::uint32_t>(at) / length;
            const int i = first + static_cast<int>(static_cast<std::uint32_t>(at) - chromosome * length);
            c[std::size_t{chromosome} * static_cast<std::size_t>(words) + static_cast<std::size_t>(i / word_bits)] ^= bit_mask(i);
            at += 1 + draw(random);
        }
        gap_ = at - total;
    }

    // Bits to skip before the next flip: the k with tail(k) > word >= tail(k+1); beyond the table's end memory starts anew.
    template <class Source>
    std::uint64_t draw(Source& random) const {
        if (tails_.back() == ~Word{0}) return never;  // m = 0
        for (std::uint64_t skipped = 0;; skipped += tails_.size()) {
            const Word u = random.word();
            if (u < tails_.back()) continue;
            std::size_t k = first_[static_cast<std::size_t>(u >> (word_bits - top_bits))];
            while (u < tails_[k]) ++k;
            return skipped + k;
        }
    }

private:
    static constexpr std::uint64_t never = std::uint64_t{1} << 62;
    static constexpr int top_bits = 12;                // so that a look-up is mostly all there is to do
    std::array<Word, 256> tails_{};                    // tails_[k] = (1-m)^(k+1) * 2^64
    std::array<std::uint8_t, 1 << top_bits> first_{};  // by the top bits of a word: the first k it can stand for
    std::uint64_t gap_ = 0;
};

// Individuals [first, first + count) of a population, as parents and in what order they mate.
struct Mating {
    std::size_t first;
    std::uint32_t count;
    int tournament;
    Word cross_below;  // threshold of the crossover rate
};

// Children [first + from, first + count) of `next`, pair by pair: the mother's tournament, the father's, the chance of crossover
// and its cuts.
// `spare` takes the second child where their number is odd.
template <class Source, class Cost>
void mate(Source& random, const Mating& m, const Word* starts, int words, const Word* now, const Cost* costs, std::size_t from,
          Word* next, Word* spare) {
    const auto at = [words](std::size_t i) { return i * static_cast<std::size_t>(words); };
    for (std::size_t k = from; k < m.count; k += 2) {
        const Word* const mother = now + at(tournament(random, costs, m.first, m.count, m.tournament));
        const Word* const father = now + at(tournament(random, costs, m.first, m.count, m.tournament));
        Word* const child1 = next + at(m.first + k);
        Word* const child2 = k + 1 < m.count ? next + at(m.first + k + 1) : spare;
        if (random.word() < m.cross_below) {
            crossover(random, starts, words, mother, father, child1, child2);
        } else {
            for (int w = 0; w < words; ++w) child1[w] = mother[w];
            for (int w = 0; w < words; ++w) child2[w] = father[w];
        }
    }
}

}  // namespace gaident
