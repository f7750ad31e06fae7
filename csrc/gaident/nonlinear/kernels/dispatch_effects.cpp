#include "../../simulation/kernels/kernels.hpp"
#include "effect_kernels.hpp"

#include <string_view>

namespace gaident {

const EffectKernel* effects_named(const char* name) {
    if (kernels_named(name) == nullptr) return nullptr;  // what the machine can run is asked in one place
    const std::string_view wanted(name);
#ifdef GAIDENT_HAVE_X86_KERNELS
    if (wanted == "avx2") return &avx2_effects();
    if (wanted == "avx512") return &avx512_effects();
#endif
    return wanted == "baseline" ? &baseline_effects() : nullptr;
}

const EffectKernel& best_effects() {
    static const EffectKernel& best = *effects_named(best_kernels().name);
    return best;
}

}  // namespace gaident
