// The one random generator of the project, specified to the bit.
//
//   word(k) = mix(key + (k + 1) * 0x9E3779B97F4A7C15),   k = 0, 1, 2, ...
//
// with `mix` the output function of SplitMix64 (Steele, Lea, Flood 2014).
// Counter form: any word of the sequence is reached without the ones before it, so a block of words has no serial dependence.
// Every number the genetic operators use is derived from these words by the integer rules below, none by a std::
// distribution, so that a seed means the same run on every machine and for every compiler.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gaident {

inline constexpr std::uint64_t golden_gamma = 0x9E3779B97F4A7C15ULL;

// Of one word, or of a register of words.
template <class W>
[[gnu::always_inline]] constexpr W mix(W z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
}

// Integer in [0, n), n < 2^32: the top 32 bits of a word times n, shifted down. Bias below n / 2^32.
constexpr std::uint32_t below(std::uint64_t word, std::uint32_t n) {
    return static_cast<std::uint32_t>(((word >> 32) * n) >> 32);
}

// out[i] = mix(base + i * golden_gamma), i = 0 .. n-1.
inline void mixed_words(std::uint64_t base, std::uint64_t* out, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) out[i] = mix(base + i * golden_gamma);
}

class Random {
public:
    explicit constexpr Random(std::uint64_t key) : key_(key) {}

    // A generator of its own for (seed, stream): trials and restarts draw from streams of one seed.
    static constexpr Random stream(std::uint64_t seed, std::uint64_t stream) {
        return Random(mix(mix(seed + golden_gamma) + stream * golden_gamma));
    }

    constexpr std::uint64_t word() { return mix(key_ + ++count_ * golden_gamma); }

    void words(std::uint64_t* out, std::size_t n) { mixed_words(skip(n), out, n); }

    // Leaves n words out; word i of them is mix(base + i * golden_gamma), base being returned.
    constexpr std::uint64_t skip(std::size_t n) {
        const std::uint64_t base = key_ + (count_ + 1) * golden_gamma;
        count_ += n;
        return base;
    }

    constexpr std::uint32_t below(std::uint32_t n) { return gaident::below(word(), n); }

    // Number in [0, 1): the top 53 bits of one word.
    constexpr double uniform() { return static_cast<double>(word() >> 11) * 0x1.0p-53; }

private:
    std::uint64_t key_;
    std::uint64_t count_ = 0;
};

// The same words, made many at a time by `fill` (kernels/): several times faster where a register takes many.
class WordStream {
public:
    using Fill = void (*)(std::uint64_t base, std::uint64_t* out, std::size_t n);
    WordStream(Random random, Fill fill) : random_(random), fill_(fill) {}

    std::uint64_t word() {
        if (at_ == size) {
            fill_(random_.skip(size), words_, size);
            at_ = 0;
        }
        return words_[at_++];
    }

private:
    static constexpr std::size_t size = 256;
    Random random_;
    Fill fill_;
    std::size_t at_ = size;
    alignas(64) std::uint64_t words_[size];
};

// A probability as a threshold: an event of probability x happens when word() < threshold(x). 1 means always, no number never.
constexpr std::uint64_t threshold(double probability) {
    if (probability >= 1.0) return ~0ULL;
    if (!(probability > 0.0)) return 0;
    return static_cast<std::uint64_t>(probability * 0x1.0p64);
}

}  // namespace gaident
