// THE list of effects: the registry, the order of the public table, and the order in which effects that share a hook act.
// A new effect is its header and one line in each of the two lists here; all else follows from it.
#pragma once

#include "actuator/torque_dead_band.hpp"
#include "actuator/torque_lag.hpp"
#include "actuator/torque_saturation.hpp"
#include "actuator/transport_delay.hpp"
#include "controller/command_rate_limit.hpp"
#include "controller/integrator_clamp.hpp"
#include "coupling/backlash.hpp"
#include "coupling/extra_resonance.hpp"
#include "coupling/hardening_stiffness.hpp"
#include "coupling/hysteretic_coupling.hpp"
#include "friction/asymmetric_friction.hpp"
#include "friction/coulomb_friction.hpp"
#include "friction/friction_drift.hpp"
#include "friction/load_dependent_friction.hpp"
#include "friction/lugre_friction.hpp"
#include "friction/position_friction.hpp"
#include "friction/presliding_friction.hpp"
#include "friction/quadratic_drag.hpp"
#include "friction/square_root_drag.hpp"
#include "friction/stribeck_friction.hpp"
#include "load/cogging.hpp"
#include "load/load_torque.hpp"
#include "load/position_inertia.hpp"
#include "load/torque_hum.hpp"
#include "load/unbalance.hpp"
#include "sensor/outliers.hpp"
#include "sensor/velocity_difference.hpp"
#include "sensor/velocity_filter.hpp"
#include "sensor/velocity_observer.hpp"
#include "sensor/velocity_quantisation.hpp"
#include "sensor/velocity_ripple.hpp"

#include "at_load.hpp"
#include "registry.hpp"
#include "several_waves.hpp"

namespace gaident {

// Those of which a model may have several waves.
using CoggingWaves = SeveralWaves<Cogging>;
using VelocityRippleWaves = SeveralWaves<VelocityRipple>;

using Effects = EffectList<CoulombFriction,        //
                           StribeckFriction,       //
                           AsymmetricFriction,     //
                           PreslidingFriction,     //
                           LugreFriction,          //
                           QuadraticDrag,          //
                           SquareRootDrag,         //
                           LoadTorque,             //
                           Unbalance,              //
                           Cogging,                //
                           CoggingWaves,           //
                           FrictionDrift,          //
                           LoadDependentFriction,  //
                           PositionFriction,       //
                           TorqueHum,              //
                           PositionInertia,        //
                           Backlash,               //
                           HardeningStiffness,     //
                           HystereticCoupling,     //
                           TorqueSaturation,       //
                           TorqueDeadBand,         //
                           TransportDelay,         //
                           TorqueLag,              //
                           IntegratorClamp,        //
                           CommandRateLimit,       //
                           VelocityDifference,     //
                           VelocityObserver,       //
                           VelocityFilter,         //
                           VelocityRipple,         //
                           VelocityRippleWaves,    //
                           VelocityQuantisation,   //
                           ExtraResonance,         //
                           Outliers>;

// Those of the shaft once more, at the load: a list of its own, so that a loop without them contains nothing of theirs.
using LoadEffects = LoadSideOf<Effects>;
// What models are made of, numbered in this order.
using AllEffects = Joined<Effects, LoadEffects>;

inline constexpr auto& effect_table = AllEffects::table;
inline constexpr int effect_count = AllEffects::size;

// An effect's number: its place in the list.
template <class E>
inline constexpr Effect effect = AllEffects::number<E>;

// By name; throws std::invalid_argument for a name that is none.
inline Effect effect_named(std::string_view name) {
    for (int i = 0; i < effect_count; ++i)
        if (name == effect_table[static_cast<std::size_t>(i)].name) return static_cast<Effect>(i);
    throw std::invalid_argument("effects: '" + std::string(name) + "' is no effect");
}
constexpr const EffectInfo& info_of(Effect e) { return effect_table[static_cast<std::size_t>(e)]; }

// How many waves an effect may have in a model.
constexpr std::size_t waves_of(const EffectInfo& info) {
    const std::string_view name = info.name;
    for (const EffectInfo& other : Effects::table)
        if (other.several_waves && std::string_view(other.name).substr(0, name.size()) == name &&
            other.count() == info.count() * static_cast<int>(most_waves))
            return most_waves;
    return 1;
}

// A set of effects; in a model each appears at most once at a side.
struct EffectSet {
    std::uint64_t bits = 0;
    static_assert(effect_count <= 64);

    static constexpr std::uint64_t bit(Effect e) { return std::uint64_t{1} << static_cast<unsigned>(e); }
    constexpr bool has(Effect e) const { return (bits & bit(e)) != 0; }
    template <class E>
    constexpr bool has() const {
        return has(effect<E>);
    }
    // Whether one of them is so.
    template <class Property>
    constexpr bool any(Property&& property) const {
        for (int i = 0; i < effect_count; ++i)
            if (has(static_cast<Effect>(i)) && property(effect_table[static_cast<std::size_t>(i)])) return true;
        return false;
    }
    constexpr bool meets(EffectSet others) const { return (bits & others.bits) != 0; }
    constexpr bool needs_two_masses() const {
        return any([](const EffectInfo& info) { return info.needs_two_masses; });
    }
    constexpr void add(Effect e) { bits |= bit(e); }
    constexpr void remove(Effect e) { bits &= ~bit(e); }
    friend constexpr bool operator==(EffectSet, EffectSet) = default;
};

// The effects that have one of these functions.
constexpr EffectSet effects_with(Hooks hooks) {
    EffectSet set;
    AllEffects::each([&]<class E>() {
        if ((E::hooks & hooks) != Hooks::none) set.add(effect<E>);
    });
    return set;
}
// Those at the load of which the effect itself has one of these functions.
constexpr EffectSet load_effects_with(Hooks hooks) {
    EffectSet set;
    LoadEffects::each([&]<class E>() {
        if ((E::AtMotor::hooks & hooks) != Hooks::none) set.add(effect<E>);
    });
    return set;
}
// Those that only the loop of several candidates has, see nonlinear/effect_run.hpp.
constexpr EffectSet effects_in_lanes_only() {
    EffectSet set = effects_with(Hooks::torque_of_time | Hooks::torque_apart | Hooks::sensor_apart);
    AllEffects::each([&]<class E>() {
        if (Apart<E>) set.add(effect<E>);
    });
    return set;
}
static_assert((effects_with(Hooks::actuator_dynamics | Hooks::sensor_dynamics).bits & ~effects_in_lanes_only().bits) == 0,
              "what has dynamics before or behind the mechanism stands apart: the loop of one candidate has no place for it");
// Those whose output is known at the ends of a substep alone, and not its mean between them.
constexpr EffectSet effects_known_at_ends() {
    EffectSet set = effects_with(Hooks::sensor | Hooks::sensor_apart);
    AllEffects::each([&]<class E>() {
        if constexpr (hook::sensor_dynamics<E> && !hook::bend_behind<E>) set.add(effect<E>);
    });
    return set;
}
// Those that depend on the shaft's angle.
constexpr EffectSet effects_that_turn() {
    EffectSet set;
    AllEffects::each([&]<class E>() {
        if (E::info.turns) set.add(effect<E>);
    });
    return set;
}

// Those at the load that depend on the angle there.
constexpr EffectSet load_effects_that_turn() {
    EffectSet set;
    LoadEffects::each([&]<class E>() {
        if (E::info.turns) set.add(effect<E>);
    });
    return set;
}

// A candidate: the linear drive and its effects.
struct EffectModel {
    Factors<double> linear;
    EffectSet effects;
    double parameter[AllEffects::parameters] = {};  // one effect's after the other's

    const double* of(Effect e) const { return parameter + AllEffects::first_parameter[static_cast<std::size_t>(e)]; }
    void add(Effect e, const double* values) {
        effects.add(e);
        for (int i = 0; i < info_of(e).count(); ++i)
            parameter[AllEffects::first_parameter[static_cast<std::size_t>(e)] + i] = values[i];
    }
    double* of(Effect e) { return parameter + AllEffects::first_parameter[static_cast<std::size_t>(e)]; }
};

}  // namespace gaident
