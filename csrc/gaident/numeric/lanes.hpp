// W candidates side by side, one per SIMD lane, by the compiler's vector extension: as many registers of the machine's own width
// as it takes, so the same source becomes one AVX-512 register, two of AVX or four of SSE per eight doubles.
// Each lane computes what a scalar would (products and sums are fused where the source says so and nowhere else), so results are equal
// bit for bit whatever the width.
//
// `Isa` is a tag with the register width in bytes.
// Kernels are compiled once per instruction set; the tag keeps their template instantiations apart,
// so that the linker never takes AVX-512 code for a machine that has none.
#pragma once

#include "arithmetic.hpp"

namespace gaident {

template <class T, int W, class Isa>
struct Lanes {
    static constexpr int per_register = static_cast<int>(Isa::register_bytes / sizeof(T));
    static constexpr int registers = W / per_register;
    static_assert(W % per_register == 0);
    typedef T Register __attribute__((vector_size(Isa::register_bytes)));
    using Fused = detail::Fused<Isa, Isa::register_bytes, sizeof(T)>;
    Register v[registers];

    Lanes() = default;
    [[gnu::always_inline]] inline explicit Lanes(double x) : Lanes(all(static_cast<T>(x))) {}

    [[gnu::always_inline]] static inline Lanes all(T x) {
        return each([x](int) { return x - Register{}; });  // which is x, also where x is -0: one load into every lane
    }
    [[gnu::always_inline]] static inline Lanes load(const T* p) {
        return each([p](int i) {
            Register r;
            __builtin_memcpy(&r, p + i * per_register, sizeof(Register));
            return r;
        });
    }
    // of(lane), number by number; numbers that lie apart do not go through memory.
    [[gnu::always_inline]] static inline Lanes gather(auto&& of) {
        return each([&](int i) {
            Register r;
#pragma GCC unroll 16
            for (int k = 0; k < per_register; ++k) r[k] = of(static_cast<std::size_t>(i * per_register + k));
            return r;
        });
    }
    [[gnu::always_inline]] inline void store(T* p) const {
        for (int i = 0; i < registers; ++i) __builtin_memcpy(p + i * per_register, &v[i], sizeof(Register));
    }

    [[gnu::always_inline]] friend inline Lanes operator+(const Lanes& a, const Lanes& b) {
        return each([&](int i) { return a.v[i] + b.v[i]; });
    }
    [[gnu::always_inline]] friend inline Lanes operator-(const Lanes& a, const Lanes& b) {
        return each([&](int i) { return a.v[i] - b.v[i]; });
    }
    [[gnu::always_inline]] friend inline Lanes operator*(const Lanes& a, const Lanes& b) {
        return each([&](int i) { return a.v[i] * b.v[i]; });
    }
    [[gnu::always_inline]] friend inline Lanes operator/(const Lanes& a, const Lanes& b) {
        return each([&](int i) { return a.v[i] / b.v[i]; });
    }
    [[gnu::always_inline]] friend inline Lanes operator-(const Lanes& a) {
        return each([&](int i) { return -a.v[i]; });
    }
    [[gnu::always_inline]] friend inline Lanes fma(const Lanes& a, const Lanes& b, const Lanes& c) {
        if constexpr (Fused::there) return each([&](int i) { return Register(Fused::plus(a.v[i], b.v[i], c.v[i])); });
        else return fused_by_call(a, b, c);
    }
    [[gnu::always_inline]] friend inline Lanes fnma(const Lanes& a, const Lanes& b, const Lanes& c) {
        if constexpr (Fused::there) return each([&](int i) { return Register(Fused::minus(a.v[i], b.v[i], c.v[i])); });
        else return fused_by_call(-a, b, c);
    }
    // For words of bits.
    [[gnu::always_inline]] friend inline Lanes operator^(const Lanes& a, const Lanes& b) {
        return each([&](int i) { return a.v[i] ^ b.v[i]; });
    }
    [[gnu::always_inline]] friend inline Lanes operator>>(const Lanes& a, int bits) {
        return each([&](int i) { return a.v[i] >> bits; });
    }
    [[gnu::always_inline]] friend inline Lanes operator*(const Lanes& a, T b) {
        return each([&](int i) { return a.v[i] * b; });
    }
    [[gnu::always_inline]] friend inline Lanes clamp(const Lanes& x, const Lanes& lo, const Lanes& hi) {
        return each([&](int i) {
            const Register low = x.v[i] < lo.v[i] ? lo.v[i] : x.v[i];
            return Register(low > hi.v[i] ? hi.v[i] : low);
        });
    }

    // a where on > 0, else b
    [[gnu::always_inline]] friend inline Lanes where(const Lanes& on, const Lanes& a, const Lanes& b) {
        return each([&](int i) { return Register(on.v[i] > Register{} ? a.v[i] : b.v[i]); });
    }

private:
    // Number by number, and not inlined: the C library's function is called for each.
    [[gnu::noinline]] static Lanes fused_by_call(const Lanes& a, const Lanes& b, const Lanes& c) {
        return each([&](int i) {
            Register r;
            for (int k = 0; k < per_register; ++k) r[k] = gaident::fma(a.v[i][k], b.v[i][k], c.v[i][k]);
            return r;
        });
    }

    template <class F>
    [[gnu::always_inline]] static inline Lanes each(F f) {
        Lanes r;
#pragma GCC unroll 8
        for (int i = 0; i < registers; ++i) r.v[i] = f(i);
        return r;
    }
};

}  // namespace gaident
