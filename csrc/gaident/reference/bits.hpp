// The referee of the genetic side: a chromosome as a row of single bits, every operator a walk over them.
//
// Slow and obvious.
// It shares with the fast operators only the random generator, the rows of the genome's table and, by definition, which random
// word is drawn when; operators.hpp, decode.hpp and chromosome.hpp must come to the same bits.
#pragma once

#include "../genetic/genome.hpp"
#include "../numeric/rng.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

namespace gaident::reference {

using Bits = std::vector<bool>;  // in reading order: Fig. 4 from left to right

inline Bits unpack(const std::uint64_t* words, int bits) {
    Bits c;
    for (int i = 0; i < bits; ++i) c.push_back((words[i / 64] >> (63 - i % 64)) % 2 == 1);
    return c;
}

inline std::vector<std::uint64_t> pack(const Bits& c) {
    std::vector<std::uint64_t> words((c.size() + 63) / 64, 0);
    for (std::size_t i = 0; i < c.size(); ++i)
        if (c[i]) words[i / 64] += std::uint64_t{1} << (63 - i % 64);
    return words;
}

// A field read bit by bit, most significant first.
inline std::uint32_t get(const Bits& c, const Field& f) {
    std::uint32_t code = 0;
    for (int i = 0; i < f.width; ++i) code = 2 * code + (c[static_cast<std::size_t>(f.first + i)] ? 1U : 0U);
    return code;
}

inline void set(Bits& c, const Field& f, std::uint32_t code) {
    for (int i = f.width - 1; i >= 0; --i) {
        c[static_cast<std::size_t>(f.first + i)] = code % 2 == 1;
        code /= 2;
    }
}

// Reflected Gray code: binary digit i is the parity of the Gray digits from the most significant down to i.
inline std::uint32_t from_gray(std::uint32_t gray, int width) {
    std::uint32_t code = 0;
    bool digit = false;
    for (int i = width - 1; i >= 0; --i) {
        if ((gray >> i) % 2 == 1) digit = !digit;
        code = 2 * code + (digit ? 1U : 0U);
    }
    return code;
}

// ------------------------------------------------------------------------------------------------ operators

// Of `size` contestants drawn with replacement from `count`, the one of lowest cost; on a tie the one drawn first.
inline std::size_t tournament(Random& random, const std::vector<double>& cost, std::size_t first, std::size_t count, int size) {
    std::vector<std::size_t> drawn;
    for (int k = 0; k < size; ++k) {
        const std::uint64_t high = random.word() >> 32;
        drawn.push_back(first + static_cast<std::size_t>((high * count) >> 32));
    }
    std::size_t winner = drawn[0];
    for (const std::size_t d : drawn)
        if (cost[d] < cost[winner]) winner = d;
    return winner;
}

// Multi-point crossover, field by field.
// Two words are drawn when the walk enters a new word of 64 bits: a bit of the first word says "cut here" where a field begins,
// and elsewhere where the second word says so too.
inline void crossover(Random& random, std::span<const Field> fields, const Bits& a, const Bits& b, Bits& child_a, Bits& child_b) {
    child_a = a;
    child_b = b;
    std::uint64_t r1 = 0, r2 = 0;
    bool swapped = false;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (i % 64 == 0) {
            r1 = random.word();
            r2 = random.word();
        }
        bool field_begins = false;
        for (const Field& f : fields) field_begins = field_begins || f.first == static_cast<int>(i);
        const bool coin1 = (r1 >> (63 - i % 64)) % 2 == 1, coin2 = (r2 >> (63 - i % 64)) % 2 == 1;
        if (coin1 && (field_begins || coin2)) swapped = !swapped;
        if (swapped) {
            child_a[i] = b[i];
            child_b[i] = a[i];
        }
    }
}

// Bit mutation: a gap is drawn, counted down bit by bit over one chromosome after the other, and the bit where it ends is
// flipped.
// The gap is at least k with probability (1-m)^k: a word u stands for the smallest gap k with u >= (1-m)^(k+1) 2^64; a word below
// the 256th power stands for "256 bits without a flip, draw again".
class Mutation {
public:
    Mutation(double probability, Random& random) : probability_(probability) { draw(random); }

    void apply(Random& random, Bits& c, std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            if (never_) return;
            if (gap_ == 0) {
                c[i] = !c[i];
                draw(random);
            } else {
                --gap_;
            }
        }
    }

private:
    void draw(Random& random) {
        gap_ = 0;
        std::uint64_t last_power = 0;
        for (;;) {
            double power = 1.0;
            for (int k = 0; k < 256; ++k) last_power = threshold(power *= 1.0 - probability_);
            never_ = last_power == ~std::uint64_t{0};
            if (never_) return;
            const std::uint64_t u = random.word();
            power = 1.0;
            for (int k = 0; k < 256; ++k, ++gap_)
                if (u >= threshold(power *= 1.0 - probability_)) return;
        }
    }

    double probability_;
    std::uint64_t gap_ = 0;
    bool never_ = false;
};

// ------------------------------------------------------------------------------------------------- decoding

using Complex = std::complex<double>;

// Equation (2): G(s) = K prod_i 1/(s + A1_i) prod_j (s + B2_j)/(s + A2_j).
struct Plant {
    double K = 0.0;
    std::vector<Complex> A1, A2, B2;
};

inline const Field& find(std::span<const Field> fields, Role role, Part part, std::size_t index) {
    for (const Field& f : fields)
        if (f.role == role && f.part == part && f.index == static_cast<int>(index)) return f;
    throw std::out_of_range("find: no such field");
}

inline double value(const Bits& c, const Field& f, Code code) {
    const std::uint32_t raw = get(c, f);
    const double t = static_cast<double>(code == Code::gray ? from_gray(raw, f.width) : raw) /
                     static_cast<double>((std::uint64_t{1} << f.width) - 1);
    return f.scale == Scale::linear ? f.range.lo + (f.range.hi - f.range.lo) * t
                                    : f.range.lo * std::exp(t * std::log(f.range.hi / f.range.lo));
}

// As docs/paper.md has it: pairs within a group first, (A11,A12), (A21,A22), (B21,B22); where both pole groups have a member left
// over, those two; what is still left is real.
// The top bit of the second member's imaginary gene says whether a pair is a conjugate pair, from the first member's genes, or
// two real numbers.
inline Plant decode(const Bits& c, std::span<const Field> fields, Code code, const SearchRanges& ranges) {
    const auto order = [&](Role role, int lo, int hi) {
        const Field& f = find(fields, role, Part::whole, 0);
        const std::uint32_t raw = get(c, f);
        const int n = static_cast<int>(code == Code::gray ? from_gray(raw, f.width) : raw);
        return static_cast<std::size_t>(std::min(std::max(n, lo), hi));
    };
    const std::size_t p = order(Role::p, ranges.p_min, ranges.p_max), q = order(Role::q, ranges.q_min, ranges.q_max);

    Plant g;
    double unit = 1.0;  // gain_scale^(p-1)
    if (p == 0) unit = 1.0 / ranges.gain_scale;
    for (std::size_t i = 1; i < p; ++i) unit *= ranges.gain_scale;
    g.K = value(c, find(fields, Role::gain, Part::whole, 0), code) * unit;

    const auto gene = [&](Role role, Part part, std::size_t i) { return value(c, find(fields, role, part, i), code); };
    for (std::size_t i = 0; i < p; ++i) g.A1.push_back(gene(Role::pole1, Part::real, i));
    for (std::size_t j = 0; j < q; ++j) g.A2.push_back(gene(Role::pole2, Part::real, j));
    for (std::size_t j = 0; j < q; ++j) g.B2.push_back(gene(Role::zero2, Part::real, j));

    const auto pair = [&](Complex& first, Role role1, std::size_t i, Complex& second, Role role2, std::size_t j) {
        if (!c[static_cast<std::size_t>(find(fields, role2, Part::imaginary, j).first)]) return;
        first = Complex(first.real(), gene(role1, Part::imaginary, i));
        second = std::conj(first);
    };
    for (std::size_t i = 0; i + 1 < p; i += 2) pair(g.A1[i], Role::pole1, i, g.A1[i + 1], Role::pole1, i + 1);
    for (std::size_t j = 0; j + 1 < q; j += 2) pair(g.A2[j], Role::pole2, j, g.A2[j + 1], Role::pole2, j + 1);
    for (std::size_t j = 0; j + 1 < q; j += 2) pair(g.B2[j], Role::zero2, j, g.B2[j + 1], Role::zero2, j + 1);
    if (p % 2 == 1 && q % 2 == 1) pair(g.A1[p - 1], Role::pole1, p - 1, g.A2[q - 1], Role::pole2, q - 1);
    return g;
}

}  // namespace gaident::reference
