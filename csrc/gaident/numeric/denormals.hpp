// Long decays are full of denormal numbers, which cost up to 75 times an ordinary one.
// While a FlushDenormals exists, the thread that made it treats them as zero; its destructor restores what the caller had, also
// after a throw.
#pragma once

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif
#include <cstdint>

namespace gaident {

class FlushDenormals {
public:
    FlushDenormals() : saved_(control()) { set_control(saved_ | flush); }
    ~FlushDenormals() { set_control(saved_); }
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;

    // The processor's control word of floating-point arithmetic, and its bits that flush denormals.
#if defined(__SSE2__)
    using Control = unsigned;
    static constexpr Control flush = 0x8000 | 0x0040;  // results, operands
    static Control control() { return _mm_getcsr(); }
    static void set_control(Control c) { _mm_setcsr(c); }
#elif defined(__aarch64__)
    using Control = std::uint64_t;
    static constexpr Control flush = 1ULL << 24;
    static Control control() {
        Control c;
        asm volatile("mrs %0, fpcr" : "=r"(c));
        return c;
    }
    static void set_control(Control c) { asm volatile("msr fpcr, %0" : : "r"(c)); }
#elif defined(__ARM_FP)  // Cortex-M with a floating-point unit
    using Control = std::uint32_t;
    static constexpr Control flush = 1U << 24;
    static Control control() {
        Control c;
        asm volatile("vmrs %0, fpscr" : "=r"(c));
        return c;
    }
    static void set_control(Control c) { asm volatile("vmsr fpscr, %0" : : "r"(c)); }
#elif defined(__wasm__)  // none: this one is for the product and sum in one, which is made by hand there (fused.hpp)
    using Control = unsigned;
    static constexpr Control flush = 1;
    static Control control() { return by_hand; }
    static void set_control(Control c) { by_hand = c; }
#else                    // none: denormals cost what they cost
    using Control = unsigned;
    static constexpr Control flush = 0;
    static Control control() { return 0; }
    static void set_control(Control) {}
#endif

private:
#if defined(__wasm__)
    static inline Control by_hand = 0;  // the core has no threads there
#endif
    Control saved_;
};

}  // namespace gaident
