// Chromosome + genome -> factors.
//
// A and B are complex numbers but the model must be real.
// The paper leaves open which pair up (docs/paper.md): pairs are taken within a group first, (A11,A12), (A21,A22), (B21,B22),
// ...; where both pole groups have a member left over, those two form a pair; what is still left is real.
// A pair is a conjugate pair (real and imaginary gene of its first member) or two real factors (both real genes): the top bit of
// the second member's imaginary gene, otherwise latent, decides (1: conjugate).
// Genes of inactive modules are latent: carried, not decoded.
#pragma once

#include "../plant/factors.hpp"
#include "genome.hpp"

namespace gaident {

// One gene of a root: which module family, which index.
struct Locus {
    Role role;
    int index;
};

// The pairing of a structure's genes: calls pair(first, second) and single(locus) for the poles or for the zeros.
template <class OnPair, class OnSingle>
void visit_poles(Structure s, OnPair&& pair, OnSingle&& single) {
    for (int i = 0; i + 1 < s.p; i += 2) pair(Locus{Role::pole1, i}, Locus{Role::pole1, i + 1});
    for (int j = 0; j + 1 < s.q; j += 2) pair(Locus{Role::pole2, j}, Locus{Role::pole2, j + 1});
    const bool left1 = s.p % 2 != 0, left2 = s.q % 2 != 0;
    if (left1 && left2) pair(Locus{Role::pole1, s.p - 1}, Locus{Role::pole2, s.q - 1});
    else if (left1) single(Locus{Role::pole1, s.p - 1});
    else if (left2) single(Locus{Role::pole2, s.q - 1});
}

template <class OnPair, class OnSingle>
void visit_zeros(Structure s, OnPair&& pair, OnSingle&& single) {
    for (int j = 0; j + 1 < s.q; j += 2) pair(Locus{Role::zero2, j}, Locus{Role::zero2, j + 1});
    if (s.q % 2 != 0) single(Locus{Role::zero2, s.q - 1});
}

// `value(field, bits)` gives a field's value in R, bits being what stands in the chromosome; `unit(p)` the unit of K.
template <class R, class Value, class Unit>
Factors<R> decode(const Word* c, const Genome& g, Value&& value, Unit&& unit) {
    Factors<R> f;
    f.structure = {g.structure(c, Role::p), g.structure(c, Role::q)};
    const auto read = [&](const Field& field) { return value(field, get_field(c, field.first, field.width)); };
    f.gain = read(g.field(Role::gain, Part::whole, 0)) * unit(f.structure.p);
    const auto real = [&](Locus a) { return read(g.field(a.role, Part::real, a.index)); };
    const auto pair = [&](Locus a, Locus b) {
        const Field& im = g.field(b.role, Part::imaginary, b.index);
        if (!get_bit(c, im.first)) return real_pair<R>(real(a), real(b));
        return conjugate_pair<R>(real(a), read(g.field(a.role, Part::imaginary, a.index)));
    };
    int n = 0;
    visit_poles(f.structure, [&](Locus a, Locus b) { f.pole_pair[n++] = pair(a, b); }, [&](Locus a) { f.pole = real(a); });
    n = 0;
    visit_zeros(f.structure, [&](Locus a, Locus b) { f.zero_pair[n++] = pair(a, b); }, [&](Locus a) { f.zero = real(a); });
    return f;
}

inline Factors<double> decode(const Word* c, const Genome& g) {
    return decode<double>(
        c, g, [&](const Field& f, std::uint32_t bits) { return g.value_of(bits, f); },
        [&](int p) { return g.ranges().gain_unit(p); });
}

}  // namespace gaident
