// Long decays are full of denormal numbers, which cost up to 75 times an ordinary one. While a FlushDenormals lives,
// the thread that made it treats them as zero; its destructor restores what the caller had, also after a throw.
#pragma once

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif
#include <cstdint>

namespace gaident {

class FlushDenormals {
public:
#if defined(__SSE2__)
    FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | flush_to_zero | denormals_are_zero); }
    ~FlushDenormals() { _mm_setcsr(saved_); }

private:
    static constexpr unsigned flush_to_zero = 0x8000, denormals_are_zero = 0x0040;
    unsigned saved_;
#elif defined(__aarch64__)
    FlushDenormals() {
        asm volatile("mrs %0, fpcr" : "=r"(saved_));
        asm volatile("msr fpcr, %0" : : "r"(saved_ | flush_to_zero));
    }
    ~FlushDenormals() { asm volatile("msr fpcr, %0" : : "r"(saved_)); }

private:
    static constexpr std::uint64_t flush_to_zero = 1ULL << 24;
    std::uint64_t saved_;
#elif defined(__ARM_FP)  // Cortex-M with a floating-point unit
    FlushDenormals() {
        asm volatile("vmrs %0, fpscr" : "=r"(saved_));
        asm volatile("vmsr fpscr, %0" : : "r"(saved_ | flush_to_zero));
    }
    ~FlushDenormals() { asm volatile("vmsr fpscr, %0" : : "r"(saved_)); }

private:
    static constexpr std::uint32_t flush_to_zero = 1U << 24;
    std::uint32_t saved_;
#else
    FlushDenormals() = default;
    ~FlushDenormals() = default;

private:
#endif
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;
};

}  // namespace gaident
