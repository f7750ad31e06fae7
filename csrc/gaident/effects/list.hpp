// THE registry of effects, in the order of the public table. A new effect is its header and one line in each of the two lists.
#pragma once

#include "friction/asymmetric_friction.hpp"
#include "coupling/backlash.hpp"
#include "load/cogging.hpp"
#include "controller/command_rate_limit.hpp"
#include "friction/coulomb_friction.hpp"
#include "coupling/extra_resonance.hpp"
#include "friction/friction_drift.hpp"
#include "coupling/hardening_stiffness.hpp"
#include "controller/integrator_clamp.hpp"
#include "load/load_torque.hpp"
#include "sensor/outliers.hpp"
#include "friction/presliding_friction.hpp"
#include "friction/quadratic_drag.hpp"
#include "friction/stribeck_friction.hpp"
#include "actuator/torque_dead_band.hpp"
#include "actuator/torque_lag.hpp"
#include "actuator/torque_saturation.hpp"
#include "actuator/transport_delay.hpp"
#include "load/unbalance.hpp"
#include "sensor/velocity_filter.hpp"
#include "sensor/velocity_quantisation.hpp"
#include "sensor/velocity_ripple.hpp"

#include <array>
#include <cstdint>

namespace gaident {

enum class Effect : std::uint8_t {
    coulomb_friction,
    stribeck_friction,
    asymmetric_friction,
    presliding_friction,
    quadratic_drag,
    load_torque,
    unbalance,
    cogging,
    friction_drift,
    backlash,
    hardening_stiffness,
    torque_saturation,
    torque_dead_band,
    transport_delay,
    torque_lag,
    integrator_clamp,
    command_rate_limit,
    velocity_filter,
    velocity_ripple,
    velocity_quantisation,
    extra_resonance,
    outliers,
};

inline constexpr std::array effect_table{
    CoulombFriction::info,  StribeckFriction::info, AsymmetricFriction::info, PreslidingFriction::info,
    QuadraticDrag::info,    LoadTorque::info,       Unbalance::info,          Cogging::info,
    FrictionDrift::info,    Backlash::info,         HardeningStiffness::info, TorqueSaturation::info,
    TorqueDeadBand::info,   TransportDelay::info,   TorqueLag::info,          IntegratorClamp::info,
    CommandRateLimit::info, VelocityFilter::info,   VelocityRipple::info,     VelocityQuantisation::info,
    ExtraResonance::info,   Outliers::info,
};
inline constexpr int effect_count = static_cast<int>(effect_table.size());

// A set of effects; in a model each appears at most once.
struct EffectSet {
    std::uint32_t bits = 0;

    static constexpr std::uint32_t bit(Effect e) { return std::uint32_t{1} << static_cast<unsigned>(e); }
    constexpr bool has(Effect e) const { return (bits & bit(e)) != 0; }
    template <class... More>
    constexpr bool has_any(More... e) const {
        return (bits & (bit(e) | ...)) != 0;
    }
    constexpr void add(Effect e) { bits |= bit(e); }
    constexpr void remove(Effect e) { bits &= ~bit(e); }
    friend constexpr bool operator==(EffectSet, EffectSet) = default;
};

// A candidate: the linear drive and its effects.
struct EffectModel {
    Factors<double> linear;
    EffectSet effects;
    double parameter[effect_count][max_effect_parameters] = {};

    const double* of(Effect e) const { return parameter[static_cast<int>(e)]; }
    void add(Effect e, const double* values) {
        effects.add(e);
        for (int i = 0; i < effect_table[static_cast<std::size_t>(e)].parameters(); ++i)
            parameter[static_cast<int>(e)][i] = values[i];
    }
};

}  // namespace gaident
