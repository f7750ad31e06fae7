// The load of two masses in the loop with effects: which effects act there, its angle, and the friction of both ends of the shaft.
#pragma once

#include "effect_run.hpp"

namespace gaident {

// One end's equation of a substep without friction, w+ = w_free - beta f.
template <class R>
struct FreeEnd {
    R w, w_free, beta;
};

// Dry friction at both ends of the shaft. With the mean torques f_M and f_L over the substep
//
//     w_M+ = w_free,M - beta_M f_M - across f_L,    w_L+ = w_free,L - back f_M - beta_L f_L
//
// and each f set-valued in its own velocity. Either end may stick or slip.
// With the motor sticking, w_M+ = 0, its f_M follows from f_L and the load moves on the shaft as if clamped:
//
//     w_L+ = w_free,L - (back/beta_M) w_free,M - (beta_L - back across/beta_M) f_L
//
// With it slipping f_M is that of the sliding motor.
// So the load's equation holds with its own f_L alone in every case, and velocity_under_friction() chooses between its
// sticking and slipping; the motor's case is the one found with the f_L before.
// Two rounds: with k = across back/(beta_M beta_L), which is at most about (omega h)^4/144, omega the resonance, a round leaves k
// of the change of f_L where the ends do not stick, and nothing where both do.
// `motor` and `load` are end(round, w_free, beta): w+ of this end under its friction.
template <class R, class Motor, class Load>
[[gnu::always_inline]] inline void under_friction_at_both(const FreeEnd<R>& at_motor, const FreeEnd<R>& at_load, R across, R back,
                                                          R& w_next, R& w_next_load, R& f_motor, R& f_load, Motor&& motor,
                                                          Load&& load) {
    const R zero = R(0.0), per_beta = R(1.0) / at_motor.beta;
    const R clamped_free = fnma(back * per_beta, at_motor.w_free, at_load.w_free);
    const R clamped_beta = fnma(back * per_beta, across, at_load.beta);
    for (int round = 0; round < 2; ++round) {
        const R w_free = fnma(across, f_load, at_motor.w_free);
        w_next = motor(round, w_free, at_motor.beta);
        f_motor = (w_free - w_next) * per_beta;
        const R slips = absolute(w_next);
        const R load_free = greater(slips, zero, fnma(back, f_motor, at_load.w_free), clamped_free);
        const R load_beta = greater(slips, zero, at_load.beta, clamped_beta);
        w_next_load = load(round, load_free, load_beta);
        f_load = (load_free - w_next_load) / load_beta;
    }
    f_motor = (fnma(across, f_load, at_motor.w_free) - w_next) * per_beta;
}

// What the loop keeps of the load.
template <class R>
struct LoadSide {
    OwnAtLoad<R> own;
    bool dry, turning;
    typename LoadEffects::States<R> states{};  // all zero
    FrictionLaw<R> law;
    R friction = R(0.0);  // of the substep before [N m]
    R braking = R(0.0);   // what the effects there brake with [N m]
    R theta = R(0.0);     // in the middle of the substep [rad]
    R twist_at_start;     // rad: the load's angle starts where the motor's does

    [[gnu::always_inline]] LoadSide(const EffectRun& run, R twist)
        : own(run),
          dry(run.effects.meets(load_effects_with(dry_hooks)) || run.effects.meets(effects_with(Hooks::inertia)) ||
              own.friction()),
          turning(run.effects.meets(load_effects_that_turn()) || run.effects.meets(effects_with(Hooks::inertia)) || own.there()),
          twist_at_start(twist) {}
};
struct NoLoadSide {
    template <class R>
    [[gnu::always_inline]] NoLoadSide(const EffectRun&, R) {}
};

}  // namespace gaident
