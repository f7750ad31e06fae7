// A substep of the loop with effects (effect_loop.hpp): the torque held becomes the torque at the shaft, and the mechanism moves on
// under it and under dry friction at either end.
#pragma once

#include "effect_loop.hpp"

namespace gaident {

template <class R, class Plant, class Control>
[[gnu::always_inline]] inline void EffectLoop<R, Plant, Control>::substep(int j, double t) {
    R T = held_;
    if (late()) {
        const PastTorques past{run_, width, issued_, j};
        const Course<R> course = Effects::chain(Course<R>{T, R(0.0)}, [&]<class E>(Course<R> x) __attribute__((always_inline)) {
            if constexpr (hook::actuator_dynamics<E> && asks<E>)
                if (run_.effects.has<E>()) return E::actuator_dynamics(c_.effects.template of<E>(), state<E>(), past, x);
            return x;
        });
        before_.rise = course.rise;
        T = plant_.risen(c_, course);
    }
    T = Effects::chain(T, [&]<class E>(R x) __attribute__((always_inline)) {
        if constexpr (hook::torque<E>)
            if (run_.effects.has<E>()) return x - E::torque(c_.effects.template of<E>(), theta_);
        return x;
    });
    const R w = plant_.velocity();
    if constexpr (OwnInLoop<R>::asks)
        if (beside_) [[unlikely]] {
            if (run_.effects.meets(effects_with(Hooks::torque_of_time)))
                T = T - torque_of_time<Side::motor>(run_, c_, R(t > 0.0 ? t : 0.0));
            if (run_.effects.meets(effects_with(Hooks::torque_apart))) [[unlikely]]
                T = T - torque_apart<Side::motor>(run_, c_, theta_);
            if (own_.shaft()) T = own_.with_torque(w, theta_, T, t);
        }
    R w_next;
    if constexpr (Plant::both_ends) {
        w_next = move_both(T, w, t);
    } else {
        const typename Plant::Free free = plant_.without_friction(T, friction_torque_);
        w_next = free.x[0];
        if (dry_) {
            w_next = under_friction<Side::motor>(states_, law_, {w, free.x[0], plant_.beta()}, t);
            if constexpr (Plant::remembers_friction) friction_torque_ = (free.x[0] - w_next) * per_beta_;
            plant_.move(free, w_next);
        } else {
            plant_.move(free);
        }
    }
    angle_ = fma(w + w_next, R(0.5 * h_), angle_);
}

// The velocity at the substep's end at one end of the shaft, and the state of its friction there.
template <class R, class Plant, class Control>
template <Side side, class States>
[[gnu::always_inline]] inline R EffectLoop<R, Plant, Control>::under_friction(States& states, const FrictionLaw<R>& law,
                                                                              const FreeEnd<R>& end, double t) {
    const R w = end.w;
    FrictionStep<R> step{R(h_), w, end.w_free, end.beta, law};
    const auto add = [&](R level) __attribute__((always_inline)) {
        step.law.level_positive = step.law.level_positive + level;
        step.law.level_negative = step.law.level_negative + level;
    };
    // A change of the inertia comes first: friction acts on what is left to be moved.
    if constexpr (Plant::changing && side == (Plant::both_ends ? Side::load : Side::motor))
        if (run_.effects.meets(effects_with(Hooks::inertia))) step = changed_inertia(run_, c_, angle_at<side>(), step);
    if constexpr (side == Side::motor)
        if (own_.friction()) add(own_.level());
    if constexpr (side == Side::load)
        if (load_.own.friction()) [[unlikely]]
            add(load_.own.level());
    each_at<side>([&]<class Key, class E>() __attribute__((always_inline)) {
        if constexpr (hook::level<E>)
            if (run_.effects.has<Key>()) add(E::level(c_.template of<Key>(), R(t > 0.0 ? t : 0.0)));
        // Asked before E is: Clang looks for the members of load_ where it does not know E yet.
        if constexpr (side == Side::load) {
            if constexpr (hook::loaded<E>)
                if (run_.effects.has<Key>()) add(E::loaded(c_.template of<Key>(), load_.braking));
            if constexpr (hook::level_of_angle<E>)
                if (run_.effects.has<Key>()) add(E::level_of_angle(c_.template of<Key>(), load_.theta));
        }
    });
    if constexpr (side == Side::motor)
        if (run_.effects.meets(effects_with(Hooks::loaded | Hooks::level_of_angle))) [[unlikely]] {
            if constexpr (width == 1) add(loaded_level_apart<false>(run_, c_, theta_));
            else if (run_.effects.meets(effects_with(Hooks::torque_apart))) add(loaded_level_apart<true>(run_, c_, theta_));
            else add(loaded_level<false>(run_, c_, theta_));
        }
    each_at<side>([&]<class Key, class E>() __attribute__((always_inline)) {
        if constexpr (hook::friction<E>)
            if (run_.effects.has<Key>()) {
                const auto& c = c_.template of<Key>();
                // Unlikely: what it needs is kept out of the registers of the others. Numbers of one register leave enough.
                if constexpr (width > 1 && Pack<R>::registers == 1) E::friction(c, states.template of<Key>(), step);
                else [[unlikely]] E::friction(c, states.template of<Key>(), step);
            }
    });
    const R w_next = velocity_under_friction(step.law, w, step.w_free, step.beta);
    constexpr EffectSet behind = (side == Side::motor ? effects_with : load_effects_with)(Hooks::after_friction);
    if (!run_.effects.meets(behind)) return w_next;
    each_at<side>([&]<class Key, class E>() __attribute__((always_inline)) {
        if constexpr (hook::after_friction<E>)
            if (run_.effects.has<Key>()) E::after_friction(c_.template of<Key>(), states.template of<Key>(), step, w_next);
    });
    return w_next;
}

// The same where effects act at the load, too, under the torque T at the motor: the motor's velocity at the end.
template <class R, class Plant, class Control>
[[gnu::always_inline]] inline R EffectLoop<R, Plant, Control>::move_both(R T, R w, double t) {
    const R w_load = plant_.load_velocity();
    R T_load = R(0.0);
    if (load_.turning || run_.effects.meets(load_effects_with(Hooks::torque | Hooks::torque_of_time | Hooks::torque_apart))) {
        const R at_motor = run_.position.empty() ? fma(w, R(0.5 * h_), angle_) : theta_;
        load_.theta = fnma(w - w_load, R(0.5 * h_), at_motor - (plant_.twist() - load_.twist_at_start));
        each_at<Side::load>([&]<class Key, class E>() __attribute__((always_inline)) {
            if constexpr (hook::torque<E>)
                if (run_.effects.has<Key>()) T_load = T_load - E::torque(c_.template of<Key>(), load_.theta);
        });
        if (run_.effects.meets(load_effects_with(Hooks::torque_apart))) [[unlikely]]
            T_load = T_load - torque_apart<Side::load>(run_, c_, load_.theta);
        load_.braking = R(0.0) - T_load;
        if (run_.effects.meets(load_effects_with(Hooks::torque_of_time))) [[unlikely]]
            T_load = T_load - torque_of_time<Side::load>(run_, c_, R(t > 0.0 ? t : 0.0));
    }
    if (load_.own.there()) [[unlikely]]
        T_load = T_load + load_.own.torque(run_, w_load, load_.theta, T, t);
    plant_.free_velocities(T, T_load, friction_torque_, load_.friction, states_);
    const FreeEnd<R> motor{w, plant_.free[0], plant_.beta()}, load{w_load, plant_.free[1], plant_.load_beta()};
    R w_next = motor.w_free, w_next_load = load.w_free;
    if (dry_ && load_.dry) {
        typename Effects::States<R> trial = states_;
        typename LoadEffects::States<R> trial_at_load = load_.states;
        under_friction_at_both(
            motor, load, plant_.across(), plant_.back(), w_next, w_next_load, friction_torque_, load_.friction,
            [&](int round, R w_free, R beta) __attribute__((always_inline)) {
                return apart<Side::motor>(round == 0 ? trial : states_, law_, {w, w_free, beta}, t);
            },
            [&](int round, R w_free, R beta) __attribute__((always_inline)) {
                return apart<Side::load>(round == 0 ? trial_at_load : load_.states, load_.law, {w_load, w_free, beta}, t);
            });
    } else if (load_.dry) {
        w_next_load = apart<Side::load>(load_.states, load_.law, load, t);
        load_.friction = (load.w_free - w_next_load) / load.beta;
        w_next = fnma(plant_.across(), load_.friction, w_next);
    } else if (dry_) {
        w_next = apart<Side::motor>(states_, law_, motor, t);
        friction_torque_ = (motor.w_free - w_next) * per_beta_;
        w_next_load = fnma(plant_.back(), friction_torque_, w_next_load);
    }
    plant_.move(friction_torque_, load_.friction, w_next, w_next_load);
    return w_next;
}

// With friction at both ends it is asked four times a substep: a call, so that it is compiled once.
template <class R, class Plant, class Control>
template <Side side, class States>
[[gnu::noinline]] R EffectLoop<R, Plant, Control>::apart(States& states, const FrictionLaw<R>& law, const FreeEnd<R>& end,
                                                         double t) {
    return under_friction<side>(states, law, end, t);
}

}  // namespace gaident
