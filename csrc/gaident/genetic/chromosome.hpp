// Chromosomes as packed bits: bit i of a chromosome is bit 63 - i % 64 of word i / 64, so a field reads most significant bit
// first and a hex dump reads like Fig. 4 of the paper. Nothing here knows what bits mean.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace gaident {

using Word = std::uint64_t;
inline constexpr int word_bits = 64;

constexpr int words_for(int bits) { return (bits + word_bits - 1) / word_bits; }

// Bit mask of position i within its word.
constexpr Word bit_mask(int i) { return Word{1} << (word_bits - 1 - i % word_bits); }

constexpr bool get_bit(const Word* c, int i) { return (c[i / word_bits] & bit_mask(i)) != 0; }

constexpr void set_bit(Word* c, int i, bool value) {
    if (value) c[i / word_bits] |= bit_mask(i);
    else c[i / word_bits] &= ~bit_mask(i);
}

// Unsigned number in bits [first, first + width), width 1..32; a field may straddle two words.
constexpr std::uint32_t get_field(const Word* c, int first, int width) {
    const int w = first / word_bits, end = first % word_bits + width;
    const Word mask = (Word{1} << width) - 1;
    if (end <= word_bits) return static_cast<std::uint32_t>((c[w] >> (word_bits - end)) & mask);
    const int spill = end - word_bits;
    return static_cast<std::uint32_t>(((c[w] << spill) | (c[w + 1] >> (word_bits - spill))) & mask);
}

constexpr void set_field(Word* c, int first, int width, std::uint32_t value) {
    for (int i = 0; i < width; ++i) set_bit(c, first + i, ((value >> (width - 1 - i)) & 1U) != 0);
}

constexpr int count_bits(const Word* c, int words) {
    int n = 0;
    for (int i = 0; i < words; ++i) n += std::popcount(c[i]);
    return n;
}

}  // namespace gaident
