// What the loop with effects needs to know of one candidate (R = double) or of one per lane: the parameters as the sample loop uses
// them, for its substep. Numbers only, so that candidates are laid side by side without naming each.
#pragma once

#include "../effects/list.hpp"
#include "../plant/two_mass.hpp"

#include "../control/closed_loop.hpp"

#include <cstring>
#include <type_traits>

namespace gaident {

template <class R>
struct EffectConstants {
    // The plant in observer form at the substep, and its state at the record's start ...
    R a[max_plant_order], b[max_plant_order + 1], x[max_plant_order];
    // ... or two masses (two_mass.hpp)
    R phi[3][3], motor[3], coupling[3];
    R KG, DG, per_scale, half_gap, cubic;

    FrictionLaw<R> law;  // the part with constant coefficients
    R stribeck_torque, stribeck_static, stribeck_slowness;
    R bristle_torque, bristle_stiffness, bristle_per_break;
    R drift_torque, drift_rate;
    R load;
    R unbalance_amplitude, unbalance_phase;
    R cogging_amplitude, cogging_order, cogging_phase;

    R saturation, dead_band, lag_decay, lag_mean;
    R integrator_limit, rate_step;
    R filter_decay, filter_old, filter_new;
    R ripple_amplitude, ripple_order, ripple_phase;
    R quantum;

    R stored;  // the controller's stored torque at the start
    R before;  // torque that acted before the record's start
};

inline constexpr std::size_t effect_constants = sizeof(EffectConstants<double>) / sizeof(double);

// Substeps per sample at most.
inline constexpr int max_substeps = 64;

// The delayed torque's mean over substep j: (1 - share) u(n - back) + share u(n - back + 1).
struct DelayTable {
    int back[max_substeps];
    double share[max_substeps];
};

template <class R>
EffectConstants<R> load_constants(const double* interleaved) {
    static_assert(std::is_trivially_copyable_v<EffectConstants<R>> && sizeof(EffectConstants<R>) == effect_constants * sizeof(R));
    R all[effect_constants];
    for (std::size_t i = 0; i < effect_constants; ++i)
        all[i] = Pack<R>::load(interleaved + i * static_cast<std::size_t>(Pack<R>::width));
    EffectConstants<R> c;
    std::memcpy(&c, all, sizeof c);
    return c;
}

}  // namespace gaident
