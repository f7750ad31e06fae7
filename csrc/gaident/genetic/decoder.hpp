// decode() (decode.hpp) for many chromosomes, straight into the lanes of a group: the same values bit for bit, but every field's
// value is looked up by its code, and where a structure's genes lie is found once per structure.
#pragma once

#include "decode.hpp"
#include "population.hpp"

#include <vector>

namespace gaident {

class Decoder {
public:
    explicit Decoder(const Genome& genome) : genome_(&genome), structure_bits_(2 * genome.structure_bits()) {
        gain_ = values(genome.field(Role::gain, Part::whole, 0));
        real_ = values(genome.field(Role::pole1, Part::real, 0));  // every A and B has the same ranges
        imaginary_ = values(genome.field(Role::pole1, Part::imaginary, 0));
        gain_slot_ = slot({Role::gain, 0}, Part::whole);
        for (Word code = 0; code < Word{1} << structure_bits_; ++code) {
            const Word c = code << (word_bits - structure_bits_);
            plans_.push_back(plan({genome.structure(&c, Role::p), genome.structure(&c, Role::q)}));
        }
    }

    const Genome& genome() const { return *genome_; }
    Structure structure(const Word* c) const { return plans_[code(c)].structure; }

    // Writes chromosomes all[index[first]], ..., all[index[last - 1]], of one structure, into lanes first..last-1.
    // `most` counts the group's factors; those that these lanes lack are set to zero.
    template <class Group>
    void place(const Population& all, const std::size_t* index, std::size_t first, std::size_t last, Group& group,
               const Counts& most) const {
        const Plan& plan = plans_[code(all[index[first]])];
        const Structure s = plan.structure;
        const auto each = [&](auto&& write) {
            for (std::size_t lane = first; lane < last; ++lane) write(all[index[lane]], lane);
        };
        const auto value = [&](bool present, const std::vector<double>& table, Slot slot, double scale, double* row) {
            if (present) each([&](const Word* c, std::size_t lane) { row[lane] = table[field(c, slot)] * scale; });
            else std::fill(row + first, row + last, 0.0);
        };
        const auto pair = [&](bool present, const PairSlots& slots, double* e1, double* e0) {
            if (present) {
                each([&](const Word* c, std::size_t lane) { put(c, slots, e1[lane], e0[lane]); });
            } else {
                std::fill(e1 + first, e1 + last, 0.0);
                std::fill(e0 + first, e0 + last, 0.0);
            }
        };
        value(true, gain_, gain_slot_, plan.gain_unit, group.gain);
        for (int i = 0; i < most.pole_pairs; ++i) pair(i < s.pole_pairs(), plan.pole[i], group.pole_e1[i], group.pole_e0[i]);
        for (int i = 0; i < most.zero_pairs; ++i) pair(i < s.zero_pairs(), plan.zero[i], group.zero_e1[i], group.zero_e0[i]);
        value(s.single_pole(), real_, plan.single_pole, 1.0, group.pole);
        value(s.single_zero(), real_, plan.single_zero, 1.0, group.zero);
        for (int i = 0; i < most.p; ++i) std::fill(group.excess[i] + first, group.excess[i] + last, i < s.p ? 1.0 : 0.0);
    }

private:
    // A field of bits: word * 2^up, filled from the next word where it straddles two, then its top `width` bits.
    struct Slot {
        std::uint8_t word = 0, next = 0, up = 0, drop = 0;
    };
    struct PairSlots {
        Slot real1, real2, imaginary1, conjugate;
    };
    struct Plan {
        Structure structure;
        double gain_unit = 1.0;
        PairSlots pole[max_pairs], zero[max_pairs];
        Slot single_pole, single_zero;
    };

    static Word field(const Word* c, Slot s) {
        return (c[s.word] << s.up | (c[s.next] >> 1) >> (word_bits - 1 - s.up)) >> s.drop;
    }
    std::size_t code(const Word* c) const { return static_cast<std::size_t>(c[0] >> (word_bits - structure_bits_)); }

    void put(const Word* c, const PairSlots& s, double& e1, double& e0) const {
        const double a = real_[field(c, s.real1)], b = real_[field(c, s.real2)], im = imaginary_[field(c, s.imaginary1)];
        const Pair<double> complex = conjugate_pair(a, im), two = real_pair(a, b);
        const bool conjugate = field(c, s.conjugate) != 0;
        e1 = conjugate ? complex.e1 : two.e1;
        e0 = conjugate ? complex.e0 : two.e0;
    }

    static Slot slot_of(int first, int width) {
        const int word = first / word_bits, up = first % word_bits;
        const int next = up + width > word_bits ? word + 1 : word;
        return {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(next), static_cast<std::uint8_t>(up),
                static_cast<std::uint8_t>(word_bits - width)};
    }
    Slot slot(Locus a, Part part) const {
        const Field& f = genome_->field(a.role, part, a.index);
        return slot_of(f.first, f.width);
    }
    PairSlots pair(Locus a, Locus b) const {
        const Slot top = slot_of(genome_->field(b.role, Part::imaginary, b.index).first, 1);
        return {slot(a, Part::real), slot(b, Part::real), slot(a, Part::imaginary), top};
    }
    Plan plan(Structure s) const {
        Plan made;
        made.gain_unit = genome_->ranges().gain_unit(s.p);
        made.structure = s;
        int pole_pairs = 0, zero_pairs = 0;
        visit_poles(
            s, [&](Locus a, Locus b) { made.pole[pole_pairs++] = pair(a, b); },
            [&](Locus a) { made.single_pole = slot(a, Part::real); });
        visit_zeros(
            s, [&](Locus a, Locus b) { made.zero[zero_pairs++] = pair(a, b); },
            [&](Locus a) { made.single_zero = slot(a, Part::real); });
        return made;
    }
    std::vector<double> values(const Field& f) const {
        std::vector<double> all;
        for (Word raw = 0; raw < Word{1} << f.width; ++raw) all.push_back(genome_->value_of(static_cast<std::uint32_t>(raw), f));
        return all;
    }

    const Genome* genome_;
    int structure_bits_;
    std::vector<double> gain_, real_, imaginary_;  // by the bits of a field
    Slot gain_slot_;
    std::vector<Plan> plans_;  // by the bits of p and q
};

}  // namespace gaident
