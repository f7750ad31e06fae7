// The mechanism behind a zero-order hold of one substep, asked twice: which velocity w+ a torque would bring, then to move, under
// the total torque, to the velocity that friction left.
#pragma once

#include "coefficients.hpp"

namespace gaident {

// Any linear plant, in the delta observer form of closed_loop.hpp; N its order, -1 where it is known only at run time.
template <class R, int N>
struct ObserverPlant {
    static constexpr bool both_ends = false;  // whether effects act at the load, too
    static constexpr int capacity = N >= 0 ? N : max_plant_order;
    R a[capacity], b[capacity + 1], x[capacity];
    int order;

    ObserverPlant(const EffectConstants<R>& c, int n) : order(N >= 0 ? N : n) {
        for (int i = 0; i < order; ++i) a[i] = c.a[i];
        for (int i = 0; i <= order; ++i) b[i] = c.b[i];
        for (int i = 0; i < order; ++i) x[i] = c.x[i];
    }

    [[gnu::always_inline]] R velocity() const { return x[0]; }
    [[gnu::always_inline]] R twist() const { return R(0.0); }
    [[gnu::always_inline]] R beta() const { return b[1]; }

    [[gnu::always_inline]] R free_velocity(R T, R) {
        const int n = N >= 0 ? N : order;
        const R own = n > 1 ? x[0] + x[1] : x[0];
        return (own + b[1] * T) - a[0] * x[0];
    }

    [[gnu::always_inline]] void move(R T, R w_next) {
        const int n = N >= 0 ? N : order;
        const R w = x[0];
        for (int i = 1; i + 1 < n; ++i) x[i] = ((x[i] + x[i + 1]) + b[i + 1] * T) - a[i] * w;
        if (n > 1) x[n - 1] = (x[n - 1] + b[n] * T) - a[n - 1] * w;
        x[0] = w_next;
    }
};

// Two masses with a nonlinear coupling.
// Its correction over the substep is the mean along a twist that goes evenly to where the correction at the substep's start, and
// the friction of the substep before, would bring it (second order). An effect of the coupling has
//
//     coupling(c, K, D, x, dx)               its correction at the twist x [rad] that goes at dx [rad/s]
//     mean_coupling(c, K, D, x0, x1, dx)     its mean along a twist that goes evenly from x0 to x1
//     loaded_twist(c, K, linear, x)          the twist that carries the torque K linear, from that without the effect
//
// and is the identity where all its coefficients are zero, as those of an effect that is not there are: computing it costs less
// than asking.
// Each leaves in x is left of the twist to the effects that follow.
template <class R>
struct TwoMassPlant {
    static constexpr bool both_ends = false;
    R phi[3][3], motor[3], coupling[3];
    R KG, DG, per_scale;
    R x[3];  // w_M, w_L, psi
    R correction = R(0.0);
    const typename Effects::Coefficients<R>& effects;

    TwoMassPlant(const EffectConstants<R>& c, int) : KG(c.KG), DG(c.DG), per_scale(c.per_scale), effects(c.effects) {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) phi[i][j] = c.phi[i][j];
            motor[i] = c.motor[i];
            coupling[i] = c.coupling[i];
            x[i] = c.x[i];
        }
    }

    [[gnu::always_inline]] R velocity() const { return x[0]; }
    [[gnu::always_inline]] R twist() const { return x[2] * per_scale; }
    [[gnu::always_inline]] R beta() const { return motor[0]; }

    [[gnu::always_inline]] R linear(int i, R T) const {
        return (x[i] + motor[i] * T) + ((phi[i][0] * x[0] + phi[i][1] * x[1]) + phi[i][2] * x[2]);
    }

    [[gnu::always_inline]] R free_velocity(R T, R friction_before) {
        const R T_total = T - friction_before;
        correct([&](int i) __attribute__((always_inline)) { return linear(i, T_total); });
        return linear(0, T) + coupling[0] * correction;
    }

    // The correction; end(i): where w_M, w_L and psi would come to without it.
    template <class End>
    [[gnu::always_inline]] void correct(End&& end) {
        const R x0 = x[2] * per_scale, dx0 = x[0] - x[1];
        R left0 = x0;
        const R now = Effects::chain(R(0.0), [&]<class E>(R sum) __attribute__((always_inline)) {
            if constexpr (hook::coupling<E>) return sum + E::coupling(effects.template of<E>(), KG, DG, left0, dx0);
            else return sum;
        });
        R left1 = (end(2) + coupling[2] * now) * per_scale;
        const R dx1 = (end(0) - end(1)) + (coupling[0] - coupling[1]) * now, dx = (dx0 + dx1) * R(0.5);
        left0 = x0;
        correction = Effects::chain(R(0.0), [&]<class E>(R sum) __attribute__((always_inline)) {
            if constexpr (hook::coupling<E>) return sum + E::mean_coupling(effects.template of<E>(), KG, DG, left0, left1, dx);
            else return sum;
        });
    }

    [[gnu::always_inline]] void move(R T, R w_next) {
        const R w_L = linear(1, T) + coupling[1] * correction, psi = linear(2, T) + coupling[2] * correction;
        x[0] = w_next;
        x[1] = w_L;
        x[2] = psi;
    }
};

// The same with torques and friction at the load, too (load_side.hpp solves it).
template <class R>
struct LoadedTwoMassPlant : TwoMassPlant<R> {
    static constexpr bool both_ends = true;
    using TwoMassPlant<R>::x, TwoMassPlant<R>::motor, TwoMassPlant<R>::coupling, TwoMassPlant<R>::correction;
    // Response to a unit torque at the load. The coupling's pulls the motor back by what it drives the load with, so that with a
    // unit torque at the motor beside it only the load is driven.
    R load[3];
    R free[3];                // w_M, w_L, psi at the substep's end without friction
    bool correcting = false;  // whether the coupling is not linear

    LoadedTwoMassPlant(const EffectConstants<R>& c, int order) : TwoMassPlant<R>(c, order) {
        for (int i = 0; i < 3; ++i) load[i] = motor[i] + coupling[i];
    }

    [[gnu::always_inline]] R load_velocity() const { return x[1]; }
    [[gnu::always_inline]] R load_beta() const { return load[1]; }
    [[gnu::always_inline]] R across() const { return load[0]; }  // of the motor's velocity to a torque at the load
    [[gnu::always_inline]] R back() const { return motor[1]; }   // and the other way

    // T and T_L at motor and load; the friction of the substep before.
    [[gnu::always_inline]] void free_velocities(R T, R T_load, R friction_before, R load_friction_before) {
        for (int i = 0; i < 3; ++i) free[i] = this->linear(i, T) + load[i] * T_load;
        if (!correcting) return;
        this->correct([&](int i) __attribute__((always_inline)) {
            return free[i] - (motor[i] * friction_before + load[i] * load_friction_before);
        });
        for (int i = 0; i < 3; ++i) free[i] = free[i] + coupling[i] * correction;
    }

    [[gnu::always_inline]] void move(R friction, R load_friction, R w_next, R w_next_load) {
        x[0] = w_next;
        x[1] = w_next_load;
        x[2] = free[2] - (motor[2] * friction + load[2] * load_friction);
    }
};

}  // namespace gaident
