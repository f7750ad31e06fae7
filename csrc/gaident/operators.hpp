// The genetic operators, as functions on words. They do not know what the bits mean; the table hands them the
// first bit of every field. Which random words each one draws is part of its definition: the referee in reference/ draws the
// same words and does the same work bit by bit.
#pragma once

#include "chromosome.hpp"
#include "rng.hpp"

#include <array>

namespace gaident {

// Tournament: `size` contestants drawn with replacement from [first, first + count), one word each; the lowest cost wins, the
// earlier drawn on a tie.
inline std::size_t tournament(Random& random, const double* cost, std::size_t first, std::uint32_t count, int size) {
    std::size_t winner = first + random.below(count);
    for (int k = 1; k < size; ++k) {
        const std::size_t rival = first + random.below(count);
        if (cost[rival] < cost[winner]) winner = rival;
    }
    return winner;
}

// Bit i becomes the parity of bits 0..i, counted from the most significant.
constexpr Word running_parity(Word x) {
    for (int s = 1; s < word_bits; s <<= 1) x ^= x >> s;
    return x;
}

// Multi-point crossover, each field on its own: between any two bits of a field is a cut with probability 1/4, and each field
// starts from either parent with probability 1/2. One child takes its bits from a until a cut, from b until the next, and so on; the
// other child takes the rest. Draws two words r1, r2 per word: cut = r1 & (r2 | start of field).
inline void crossover(Random& random, const Word* starts, int words, const Word* a, const Word* b, Word* child_a, Word* child_b) {
    Word carried = 0;  // all ones while the segment that reaches over the word's edge comes from the other parent
    for (int w = 0; w < words; ++w) {
        const Word r1 = random.word(), r2 = random.word();
        const Word other = running_parity(r1 & (r2 | starts[w])) ^ carried;
        carried = (other & 1) != 0 ? ~Word{0} : Word{0};
        const Word swap = (a[w] ^ b[w]) & other;
        child_a[w] = a[w] ^ swap;
        child_b[w] = b[w] ^ swap;
    }
}

// Bit mutation: every bit flips with probability m, independently. Drawn by the gaps between flips, which are geometric,
// P(gap >= k) = (1-m)^k: one word per flip instead of one per bit. The gap runs on from one chromosome to the next.
class Mutation {
public:
    Mutation(double probability, Random& random) {
        double tail = 1.0;
        for (auto& t : tails_) {
            tail *= 1.0 - probability;
            t = threshold(tail);
        }
        gap_ = draw(random);
    }

    // Flips bits of [first, last) of one chromosome.
    void apply(Random& random, Word* c, int first, int last) {
        const auto length = static_cast<std::uint64_t>(last - first);
        std::uint64_t at = gap_;
        while (at < length) {
            const int i = first + static_cast<int>(at);
            c[i / word_bits] ^= bit_mask(i);
            at += 1 + draw(random);
        }
        gap_ = at - length;
    }

    // Bits to skip before the next flip: the k with tail(k) > word >= tail(k+1); beyond the table's end memory starts anew.
    std::uint64_t draw(Random& random) const {
        if (tails_.back() == ~Word{0}) return never;  // m = 0
        for (std::uint64_t skipped = 0;; skipped += tails_.size()) {
            const Word u = random.word();
            if (u >= tails_.back()) {
                std::size_t lo = 0, hi = tails_.size() - 1;  // the first k with u >= tails_[k]
                while (lo < hi) {
                    const std::size_t mid = (lo + hi) / 2;
                    if (u >= tails_[mid]) hi = mid;
                    else lo = mid + 1;
                }
                return skipped + lo;
            }
        }
    }

private:
    static constexpr std::uint64_t never = std::uint64_t{1} << 62;
    std::array<Word, 256> tails_{};  // tails_[k] = (1-m)^(k+1) * 2^64
    std::uint64_t gap_ = 0;
};

}  // namespace gaident
