#include "effect_kernels.hpp"

namespace gaident {

namespace {
struct Isa_effects_avx2 {
    static constexpr int register_bytes = 32;
};

void run(const EffectRun& run, const double* constants) {
    using L = Lanes<double, static_cast<int>(effect_lanes), Isa_effects_avx2>;
    run_effects<L>(run, load_constants<L>(constants));
}

void alone(const EffectRun& run, const double* constants) {
    using One = Single<double, Isa_effects_avx2>;
    run_effects<One>(run, load_constants<One>(constants));
}
}  // namespace

const EffectKernel& avx2_effects() {
    static const EffectKernel kernel{"avx2", run, alone};
    return kernel;
}

}  // namespace gaident
