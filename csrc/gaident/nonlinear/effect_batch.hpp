// One model or many against one record, with effects or without.
//
// Without effects all loops are the linear ones of batch.hpp, but for a servo's.
// With effects, and under a servo, the sampled and the open loop are effect_loop.hpp; in the continuous loop the answer is
//
//     bilinear loop of the linear part + (fine loop with effects - fine loop without),
//
// which is the bilinear loop exactly where no effect acts, and a fine integration in what effects change.
#pragma once

#include "../simulation/batch.hpp"
#include "kernels/effect_kernels.hpp"
#include "effect_prepare.hpp"

namespace gaident {

struct EffectOutputs {
    double* velocity = nullptr;  // models x logged samples, row after row; as the sensor shows it
    double* torque = nullptr;    // as the controller issues it; may be null
    double* angle = nullptr;     // the motor's true angle; may be null
    // The load of two masses: its velocity, and its angle less the motor's, from which it starts; in the continuous loop those of
    // the fine loop. Both or none; other models have none.
    double* load_velocity = nullptr;
    double* load_lag = nullptr;
};

struct EffectJob {
    EffectRecord record;
    Loop loop;
    int substeps = 0;  // 0: as each model needs
    int workers = 1;
    const EffectKernel* kernel = &best_effects();
    bool lanes = true;                        // false: every model alone; the result is the same
    OwnEffects* own = nullptr;                // of all models, asked by one thread only: with them `workers` does not count
    const std::atomic<bool>* stop = nullptr;  // soon after it is set Stopped is thrown
};

// `starts`: as EffectModel's linear part takes it in prepare(), one per model or none (rest).
// Models without any effect give no angle of their own: theirs is the trapezoidal integral of the velocity.
void simulate_effects(const EffectJob& job, std::span<const EffectModel> models, std::span<const double* const> starts,
                      const EffectOutputs& out);

}  // namespace gaident
