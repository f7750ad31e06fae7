// The sample loop with effects over eight candidates, compiled once per instruction set and chosen when the program starts.
#pragma once

#include "../run_effects.hpp"

namespace gaident {

struct EffectKernel {
    const char* name;
    // `constants`: effect_constants numbers, each once per lane.
    void (*run)(const EffectRun&, const double* constants);
    // One candidate, and each number once.
    void (*alone)(const EffectRun&, const double* constants);
};

inline constexpr std::size_t effect_lanes = 8;

const EffectKernel& baseline_effects();
#ifdef GAIDENT_HAVE_X86_KERNELS
const EffectKernel& avx2_effects();
const EffectKernel& avx512_effects();
#endif

// By name ("baseline", "avx2", "avx512"); nullptr where not built or not runnable here.
const EffectKernel* effects_named(const char* name);
const EffectKernel& best_effects();

}  // namespace gaident
