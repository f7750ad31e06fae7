// Factors + genome -> chromosome: the way back, for seeds and tests.
#pragma once

#include "decode.hpp"
#include "../plant/roots.hpp"

namespace gaident {

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
