// The mechanism behind a zero-order hold of one substep, asked twice: which state the torque would bring without friction, velocity
// w_free, then to move to the velocity w+ that friction left. A friction f takes beta f from the velocity and b_i f from the state x_i:
//
//     x_i+ = free_i + (b_i/beta) (w+ - w_free)
//
// so that from w+ to the next substep there are two operations, a difference and a fused product and sum.
#pragma once

#include "coefficients.hpp"

namespace gaident {

// A state as what filters the velocity sees it.
template <class R, int n>
struct Seen {
    R x[n];
};

// A state before the substep, and the rise of its torque.
template <class R, int n>
struct SeenBefore {
    Seen<R, n> state;
    R rise = R(0.0);

    // By how much the mean velocity over the substep is above that of its ends, behind which the state is `now`.
    [[gnu::always_inline]] R bend(const EffectConstants<R>& c, const Seen<R, n>& now) {
        R sum = c.bend_rise * rise;
        for (int i = 0; i < n && i < 2; ++i) sum = fma(c.bend_end[i], now.x[i], sum);
        for (int i = 0; i < n; ++i) sum = fma(c.bend[i], state.x[i], sum);
        // An end that sticks does so all the time, whatever its torque does.
        sum = greater(fma(now.x[0], now.x[0], state.x[0] * state.x[0]), R(0.0), sum, R(0.0));
        state = now;
        return sum;
    }
};

// Any linear plant, in the delta observer form of closed_loop.hpp; N its order, -1 where it is known only at run time.
template <class R, int N>
struct ObserverPlant {
    static constexpr bool both_ends = false;           // whether effects act at the load, too
    static constexpr bool changing = false;            // whether its inertia may change with the angle
    static constexpr bool remembers_friction = false;  // of the substep before
    static constexpr int capacity = N >= 0 ? N : max_plant_order;
    R a[capacity], b[capacity + 1], x[capacity];
    R share[capacity];  // b_i/beta
    int order;
    // The state at the substep's end without friction.
    struct Free {
        R x[capacity];
    };

    ObserverPlant(const EffectConstants<R>& c, int n) : order(N >= 0 ? N : n) {
        for (int i = 0; i < order; ++i) a[i] = c.a[i];
        for (int i = 0; i <= order; ++i) b[i] = c.b[i];
        for (int i = 0; i < order; ++i) x[i] = c.x[i];
        for (int i = 0; i < order; ++i) share[i] = c.b[i + 1] / c.b[1];
    }

    [[gnu::always_inline]] R velocity() const { return x[0]; }
    [[gnu::always_inline]] R twist() const { return R(0.0); }
    [[gnu::always_inline]] R beta() const { return b[1]; }

    // w is there first, x[1] and x[2] two operations later.
    [[gnu::always_inline]] Free without_friction(R T, R) {
        const int n = N >= 0 ? N : order;
        const R w = x[0];
        Free free;
        for (int i = 0; i < n; ++i) {
            free.x[i] = fnma(a[i], w, fma(b[i + 1], T, x[i]));
            if (i + 1 < n) free.x[i] = free.x[i] + x[i + 1];
        }
        return free;
    }

    // The torque that is the same as a course with its rise, from a state that is moved for it (but its velocity).
    [[gnu::always_inline]] R risen(const EffectConstants<R>& c, const Course<R>& T) {
        const int n = N >= 0 ? N : order;
        for (int i = 1; i < n; ++i) x[i] = fma(c.rise[i], T.rise, x[i]);
        return fma(c.rise[0], T.rise, T.mean);
    }
    // Of the state now.
    [[gnu::always_inline]] Seen<R, capacity> seen() const {
        Seen<R, capacity> now{};
        const int n = N >= 0 ? N : order;
        for (int i = 0; i < n; ++i) now.x[i] = x[i];
        return now;
    }

    [[gnu::always_inline]] void move(const Free& free) {
        const int n = N >= 0 ? N : order;
        for (int i = 0; i < n; ++i) x[i] = free.x[i];
    }
    [[gnu::always_inline]] void move(const Free& free, R w_next) {
        const int n = N >= 0 ? N : order;
        const R change = w_next - free.x[0];
        for (int i = 1; i < n; ++i) x[i] = fma(share[i], change, free.x[i]);
        x[0] = w_next;
    }
};

// The same where the inertia changes with the angle: a loop of its own, so that the others' code contains nothing of it.
template <class R>
struct ChangingPlant : ObserverPlant<R, -1> {
    static constexpr bool changing = true;
    using ObserverPlant<R, -1>::ObserverPlant;
};

// Two masses with a nonlinear coupling.
// Its correction over the substep is the mean along a twist that goes evenly to where the correction at the substep's start, and
// the friction of the substep before, would bring it (second order). An effect of the coupling has
//
//     coupling(c, K, D, x, dx)               its correction at the twist x [rad] that goes at dx [rad/s]
//     mean_coupling(c, K, D, x0, x1, dx)     its mean along a twist that goes evenly from x0 to x1
//     loaded_twist(c, K, linear, x)          the twist that carries the torque K linear, from that without the effect
//
// or, where it remembers the way of the twist in a state s, in the place of the first two
//
//     wound(c, s, x)                         its correction at the twist x, to which it takes its state
//     mean_wound(c, s, x)                    its mean along a twist that goes evenly from there to x
//
// and is the identity where all its coefficients are zero, as those of an effect that is not there are: computing it costs less
// than asking.
// Each leaves in x is left of the twist to the effects that follow.
template <class R>
struct TwoMassPlant {
    static constexpr bool both_ends = false, remembers_friction = true, changing = false;
    static constexpr int capacity = 3;
    R phi[3][3], motor[3], coupling[3];
    R KG, DG, per_scale;
    R x[3];      // w_M, w_L, psi
    R share[3];  // motor/beta
    // The same at the substep's end without friction.
    struct Free {
        R x[3];
    };
    R correction = R(0.0);
    const typename Effects::Coefficients<R>& effects;

    TwoMassPlant(const EffectConstants<R>& c, int) : KG(c.KG), DG(c.DG), per_scale(c.per_scale), effects(c.effects) {
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) phi[i][j] = c.phi[i][j];
            motor[i] = c.motor[i];
            coupling[i] = c.coupling[i];
            x[i] = c.x[i];
            share[i] = c.motor[i] / c.motor[0];
        }
    }

    [[gnu::always_inline]] R velocity() const { return x[0]; }
    [[gnu::always_inline]] R twist() const { return x[2] * per_scale; }
    [[gnu::always_inline]] R beta() const { return motor[0]; }

    [[gnu::always_inline]] R linear(int i, R T) const {
        return fma(phi[i][0], x[0], fma(motor[i], T, x[i])) + fma(phi[i][2], x[2], phi[i][1] * x[1]);
    }

    [[gnu::always_inline]] Free without_friction(R T, R friction_before) {
        Free free{{linear(0, T), linear(1, T), linear(2, T)}};
        const auto as_it_is = [](R sum, R) __attribute__((always_inline)) { return sum; };
        correct([&](int i) __attribute__((always_inline)) { return fnma(motor[i], friction_before, free.x[i]); }, as_it_is,
                as_it_is);
        for (int i = 0; i < 3; ++i) free.x[i] = fma(coupling[i], correction, free.x[i]);
        return free;
    }

    [[gnu::always_inline]] R risen(const EffectConstants<R>& c, const Course<R>& T) {
        for (int i = 1; i < 3; ++i) x[i] = fma(c.rise[i], T.rise, x[i]);
        return fma(c.rise[0], T.rise, T.mean);
    }
    [[gnu::always_inline]] Seen<R, 3> seen() const { return {{x[0], x[1], x[2]}}; }

    // The correction; end(i): where w_M, w_L and psi would come to without it; wound, mean_wound: (sum, x) with what remembers.
    template <class End, class Wound, class MeanWound>
    [[gnu::always_inline]] void correct(End&& end, Wound&& wound, MeanWound&& mean_wound) {
        const R x0 = x[2] * per_scale, dx0 = x[0] - x[1];
        R left0 = x0;
        const R without = Effects::chain(R(0.0), [&]<class E>(R sum) __attribute__((always_inline)) {
            if constexpr (hook::coupling<E>) return sum + E::coupling(effects.template of<E>(), KG, DG, left0, dx0);
            else return sum;
        });
        const R now = wound(without, x0), x1 = fma(coupling[2], now, end(2)) * per_scale;
        R left1 = x1;
        const R dx1 = fma(coupling[0] - coupling[1], now, end(0) - end(1)), dx = (dx0 + dx1) * R(0.5);
        left0 = x0;
        const R mean = Effects::chain(R(0.0), [&]<class E>(R sum) __attribute__((always_inline)) {
            if constexpr (hook::coupling<E>) return sum + E::mean_coupling(effects.template of<E>(), KG, DG, left0, left1, dx);
            else return sum;
        });
        correction = mean_wound(mean, x1);
    }

    [[gnu::always_inline]] void move(const Free& free) {
        for (int i = 0; i < 3; ++i) x[i] = free.x[i];
    }
    [[gnu::always_inline]] void move(const Free& free, R w_next) {
        const R change = w_next - free.x[0];
        x[0] = w_next;
        for (int i = 1; i < 3; ++i) x[i] = fma(share[i], change, free.x[i]);
    }
};

// The same with torques and friction at the load, too (load_side.hpp solves it).
template <class R>
struct LoadedTwoMassPlant : TwoMassPlant<R> {
    static constexpr bool both_ends = true, changing = true;
    using TwoMassPlant<R>::x, TwoMassPlant<R>::phi, TwoMassPlant<R>::motor, TwoMassPlant<R>::coupling,
        TwoMassPlant<R>::correction;
    // Response to a unit torque at the load.
    // The coupling's pulls the motor back by what it drives the load with,
    // so that with a unit torque at the motor beside it only the load is driven.
    R load[3];
    R free[3];                 // w_M, w_L, psi at the substep's end without friction
    bool correcting = false;   // whether the coupling is not linear,
    bool remembering = false;  // and remembers the way of its twist
    bool rising = false;       // whether the torque rises within substeps,
    R late[2] = {};            // and what that makes of w_L and psi: friction at the load asks for them without it

    LoadedTwoMassPlant(const EffectConstants<R>& c, int order) : TwoMassPlant<R>(c, order) {
        for (int i = 0; i < 3; ++i) load[i] = motor[i] + coupling[i];
    }

    [[gnu::always_inline]] R risen(const EffectConstants<R>& c, const Course<R>& T) {
        rising = true;
        for (int i = 0; i < 2; ++i) late[i] = c.rise[i + 1] * T.rise;
        return fma(c.rise[0], T.rise, T.mean);
    }
    [[gnu::always_inline]] R load_velocity() const { return x[1]; }
    [[gnu::always_inline]] R load_beta() const { return load[1]; }
    [[gnu::always_inline]] R across() const { return load[0]; }  // of the motor's velocity to a torque at the load
    [[gnu::always_inline]] R back() const { return motor[1]; }   // and the other way

    // A call: few models have it, and the others' code stays as it is.
    [[gnu::noinline]] void rise() {
        for (int i = 0; i < 3; ++i) free[i] = free[i] + fma(phi[i][2], late[1], phi[i][1] * late[0]);
        for (int i = 0; i < 2; ++i) free[i + 1] = free[i + 1] + late[i];
    }

    // T and T_L at motor and load; the friction of the substep before; the states of the effects.
    template <class States>
    [[gnu::always_inline]] void free_velocities(R T, R T_load, R friction_before, R load_friction_before, States& states) {
        for (int i = 0; i < 3; ++i) free[i] = fma(load[i], T_load, this->linear(i, T));
        if (rising) [[unlikely]]
            rise();
        if (!correcting) return;
        const auto with_memory = [&](R sum, auto&& asked) __attribute__((always_inline)) {
            if (!remembering) return sum;
            return Effects::chain(sum, [&]<class E>(R before) __attribute__((always_inline)) {
                if constexpr (hook::hysteresis<E>) return before + asked.template operator()<E>();
                else return before;
            });
        };
        this->correct(
            [&](int i) __attribute__((always_inline)) {
                return fnma(load[i], load_friction_before, fnma(motor[i], friction_before, free[i]));
            },
            [&](R sum, R twist) __attribute__((always_inline)) {
                return with_memory(sum, [&]<class E>() __attribute__((always_inline)) {
                    return E::wound(this->effects.template of<E>(), states.template of<E>(), twist);
                });
            },
            [&](R sum, R twist) __attribute__((always_inline)) {
                return with_memory(sum, [&]<class E>() __attribute__((always_inline)) {
                    return E::mean_wound(this->effects.template of<E>(), states.template of<E>(), twist);
                });
            });
        for (int i = 0; i < 3; ++i) free[i] = fma(coupling[i], correction, free[i]);
    }

    [[gnu::always_inline]] void move(R friction, R load_friction, R w_next, R w_next_load) {
        x[0] = w_next;
        x[1] = w_next_load;
        x[2] = fnma(load[2], load_friction, fnma(motor[2], friction, free[2]));
    }
};

}  // namespace gaident
