// From a model with effects to the numbers of its sample loop.
#pragma once

#include "coefficients.hpp"
#include "../simulation/record.hpp"

#include <span>

namespace gaident {

// What a model is run against; without input, a run that has no end, for who writes its recurrence down.
// The position is the measured one or empty; the angle then starts at `start_angle`.
struct EffectRecord {
    std::span<const double> input, position;
    std::span<const double> velocity_feedforward, torque_feedforward;  // [rad/s], [N m] of a servo, or empty
    double sample_time = 0.0;                                          // of these signals, and of the controller
    int log_every = 1;                                                 // outputs are those of the first of so many samples
    double start_angle = 0.0;
    double torque_before = 0.0;  // of the open loop, before the record [N m]
    double top_speed = 0.0;      // of the measured velocity [rad/s], for the choice of substeps
};

// The model without the effects whose parameters are neutral, and with those that change the mechanism linearly multiplied into
// its factors: these also where they are neutral and the record begins in motion, as their states are among those given.
EffectModel reduced(const EffectModel& model, bool moving);

// The reduced model behind a controller whose torque acts `delay` [s] after its sample.
void delay_torque(EffectModel& model, double delay);

// Steps per sample that the reduced model needs: a power of two, so that neighbouring models have the same.
// `own`: effects that the core does not know act as well.
int substeps_for(const EffectModel& model, const EffectRecord& record, const Loop& loop, bool own = false);

struct PreparedEffects {
    EffectConstants<double> constants;
    typename Effects::Tables tables{};
    bool two_masses = false;
};

// `start`: the state of the linear loop as in prepare(), null for rest. Throws std::invalid_argument for p = 0.
// `both_ends`: the load of two masses is asked for, or effects that the core does not know act there.
void prepare_effects(const EffectModel& model, const EffectRecord& record, const Loop& loop, int substeps, const double* start,
                     PreparedEffects& out, bool both_ends = false);

}  // namespace gaident
