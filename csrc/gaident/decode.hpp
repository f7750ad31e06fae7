// Chromosome + genome -> factors, and back.
//
// A and B are complex numbers but the model must be real. METHOD: pairs are taken within a group first, (A11,A12), (A21,A22),
// (B21,B22), ...; where both pole groups have a member left over, those two form a pair; what is still left is real. A pair is a conjugate
// pair (real and imaginary gene of its first member) or two real factors (both real genes): the top bit of the second member's
// imaginary gene, otherwise latent, decides (1: conjugate). Genes of inactive modules are latent: carried, not decoded.
#pragma once

#include "factors.hpp"
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

inline Factors<double> decode(const Word* c, const Genome& g) {
    Factors<double> f;
    f.structure = {g.structure(c, Role::p), g.structure(c, Role::q)};
    f.gain = g.value(c, g.field(Role::gain, Part::whole, 0)) * g.ranges().gain_unit(f.structure.p);
    const auto real = [&](Locus a) { return g.value(c, g.field(a.role, Part::real, a.index)); };
    const auto pair = [&](Locus a, Locus b) {
        const Field& im = g.field(b.role, Part::imaginary, b.index);
        if (!get_bit(c, im.first)) return real_pair(real(a), real(b));
        return conjugate_pair(real(a), g.value(c, g.field(a.role, Part::imaginary, a.index)));
    };
    int n = 0;
    visit_poles(
        f.structure, [&](Locus a, Locus b) { f.pole_pair[n++] = pair(a, b); }, [&](Locus a) { f.pole = real(a); });
    n = 0;
    visit_zeros(
        f.structure, [&](Locus a, Locus b) { f.zero_pair[n++] = pair(a, b); }, [&](Locus a) { f.zero = real(a); });
    return f;
}

// Writes structure, gain and the active genes of `f`; latent genes keep their bits. Values take the nearest code.
inline void encode(const Factors<double>& f, const Genome& g, Word* c) {
    g.set_structure(c, f.structure.p, f.structure.q);
    g.set_value(c, g.field(Role::gain, Part::whole, 0), f.gain / g.ranges().gain_unit(f.structure.p));
    const auto set = [&](Locus a, Part part, double x) { g.set_value(c, g.field(a.role, part, a.index), x); };
    const auto pair = [&](Locus a, Locus b, Pair<double> e) {
        std::complex<double> a1, a2;
        split(e, a1, a2);
        const bool conjugate = a1.imag() != 0.0;
        set_bit(c, g.field(b.role, Part::imaginary, b.index).first, conjugate);
        set(a, Part::real, a1.real());
        if (conjugate) set(a, Part::imaginary, a1.imag());
        else set(b, Part::real, a2.real());
    };
    int n = 0;
    visit_poles(
        f.structure, [&](Locus a, Locus b) { pair(a, b, f.pole_pair[n++]); }, [&](Locus a) { set(a, Part::real, f.pole); });
    n = 0;
    visit_zeros(
        f.structure, [&](Locus a, Locus b) { pair(a, b, f.zero_pair[n++]); }, [&](Locus a) { set(a, Part::real, f.zero); });
}

}  // namespace gaident
