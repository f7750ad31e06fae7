// W candidates side by side, one per SIMD lane, by the compiler's vector extension: the same source becomes two
// AVX-512 registers, four AVX ones or eight SSE ones, and each lane computes what a scalar would (the build forbids contraction
// to fused multiply-add), so results are equal bit for bit whatever the width of the machine.
//
// `Isa` is an empty tag. Kernels are compiled once per instruction set; the tag keeps their template instantiations
// apart, so that the linker never takes AVX-512 code for a machine that has none.
#pragma once

#include "arithmetic.hpp"

namespace gaident {

template <class T, int W, class Isa>
struct Lanes {
    typedef T Vector __attribute__((vector_size(W * sizeof(T))));
    Vector v;

    Lanes() = default;
    [[gnu::always_inline]] inline explicit Lanes(double x) : v(Vector{} + static_cast<T>(x)) {}
    [[gnu::always_inline]] inline explicit Lanes(Vector x) : v(x) {}

    [[gnu::always_inline]] static inline Lanes load(const T* p) {
        Lanes r;
        __builtin_memcpy(&r.v, p, sizeof(Vector));
        return r;
    }
    [[gnu::always_inline]] inline void store(T* p) const { __builtin_memcpy(p, &v, sizeof(Vector)); }

    [[gnu::always_inline]] friend inline Lanes operator+(Lanes a, Lanes b) { return Lanes(a.v + b.v); }
    [[gnu::always_inline]] friend inline Lanes operator-(Lanes a, Lanes b) { return Lanes(a.v - b.v); }
    [[gnu::always_inline]] friend inline Lanes operator*(Lanes a, Lanes b) { return Lanes(a.v * b.v); }
    [[gnu::always_inline]] friend inline Lanes operator/(Lanes a, Lanes b) { return Lanes(a.v / b.v); }
    [[gnu::always_inline]] friend inline Lanes operator-(Lanes a) { return Lanes(-a.v); }
    [[gnu::always_inline]] friend inline Lanes clamp(Lanes x, Lanes lo, Lanes hi) {
        const Vector low = x.v < lo.v ? lo.v : x.v;
        return Lanes(Vector(x.v > hi.v ? hi.v : low));
    }
};

}  // namespace gaident
