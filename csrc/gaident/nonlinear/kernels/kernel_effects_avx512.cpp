#include "effect_kernels.hpp"

namespace gaident {

namespace {
struct Isa_effects_avx512 {
    static constexpr int register_bytes = 64;
};

void run(const EffectRun& run, const double* constants) {
    using L = Lanes<double, static_cast<int>(effect_lanes), Isa_effects_avx512>;
    run_effects<L>(run, load_constants<L>(constants));
}

void alone(const EffectRun& run, const double* constants) {
    using One = Single<double, Isa_effects_avx512>;
    run_effects<One>(run, load_constants<One>(constants));
}
}  // namespace

const EffectKernel& avx512_effects() {
    static const EffectKernel kernel{"avx512", run, alone};
    return kernel;
}

}  // namespace gaident
