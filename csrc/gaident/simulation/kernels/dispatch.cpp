#include "kernels.hpp"

#include <string_view>

namespace gaident {

const Kernels* kernels_named(const char* name) {
    const std::string_view wanted(name);
    if (wanted == "baseline") return &baseline_kernels();
#ifdef GAIDENT_HAVE_X86_KERNELS
    if (wanted == "avx2" && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return &avx2_kernels();
    if (wanted == "avx512" && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("fma"))
        return &avx512_kernels();
#endif
    return nullptr;
}

const Kernels& best_kernels() {
    static const Kernels& best = []() -> const Kernels& {
        for (const char* name : {"avx512", "avx2"})
            if (const Kernels* k = kernels_named(name)) return *k;
        return baseline_kernels();
    }();
    return best;
}

}  // namespace gaident
