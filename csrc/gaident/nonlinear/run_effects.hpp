// The loop with effects for the mechanism that a run has.
#pragma once

#include "effect_substep.hpp"

namespace gaident {

template <class Loop>
[[gnu::noinline]] void run_in_memory(Loop& loop) {
    loop();
}

// Where a number takes one register, the compiler keeps the loop's state in registers.
// Where it takes several, moving the state took up to 25 % more instructions: behind a call it stays in memory.
template <class R, class Plant>
[[gnu::always_inline]] inline void run_effects_on(const EffectRun& run, const EffectConstants<R>& c) {
    typename Effects::StatesApart<R> apart{};  // all zero
    EffectLoop<R, Plant, ControllerState<R>> loop(run, c, apart);
    if constexpr (Pack<R>::registers == 1) loop();
    else run_in_memory(loop);
}

template <class R, class Plant>
[[gnu::noinline]] void run_servo_on(const EffectRun& run, const EffectConstants<R>& c) {
    typename Effects::StatesApart<R> apart{};  // all zero
    EffectLoop<R, Plant, Servo<R>> loop(run, c, apart);
    run_in_memory(loop);
}

// Apart from the others, whose code it would change: with friction at both ends its state is too large for registers.
template <class R>
[[gnu::noinline]] void run_loaded_on(const EffectRun& run, const EffectConstants<R>& c) {
    typename Effects::StatesApart<R> apart{};  // all zero
    EffectLoop<R, LoadedTwoMassPlant<R>, ControllerState<R>> loop(run, c, apart);
    run_in_memory(loop);
}

template <class R>
[[gnu::noinline]] void run_changing_on(const EffectRun& run, const EffectConstants<R>& c) {
    typename Effects::StatesApart<R> apart{};  // all zero
    EffectLoop<R, ChangingPlant<R>, ControllerState<R>> loop(run, c, apart);
    run_in_memory(loop);
}

// Runs the lanes whose constants are given, with the plant's order known to the compiler where it is a usual one.
template <class R>
void run_effects(const EffectRun& run, const EffectConstants<R>& c) {
    // What a coupling remembers is a state of this plant alone, so that the others' code stays what it was.
    // It alone tells the load's motion.
    const bool changing = run.effects.meets(effects_with(Hooks::inertia));
    const bool at_both_ends = run.effects.meets(effects_with(Hooks::load | Hooks::hysteresis)) || run.own_at_load ||
                              (run.two_masses && changing) || run.load_velocity != nullptr;
    if (run.loop.kind == LoopKind::servo) {
        if (at_both_ends) return run_servo_on<R, LoadedTwoMassPlant<R>>(run, c);
        if (run.two_masses) return run_servo_on<R, TwoMassPlant<R>>(run, c);
        if (changing) return run_servo_on<R, ChangingPlant<R>>(run, c);
        if (run.order == 3) return run_servo_on<R, ObserverPlant<R, 3>>(run, c);
        return run_servo_on<R, ObserverPlant<R, -1>>(run, c);
    }
    if (at_both_ends) return run_loaded_on<R>(run, c);
    if (run.two_masses) return run_effects_on<R, TwoMassPlant<R>>(run, c);
    if (changing) return run_changing_on<R>(run, c);
    switch (run.order) {
        case 1: return run_effects_on<R, ObserverPlant<R, 1>>(run, c);
        case 2: return run_effects_on<R, ObserverPlant<R, 2>>(run, c);
        case 3: return run_effects_on<R, ObserverPlant<R, 3>>(run, c);
        case 5: return run_effects_on<R, ObserverPlant<R, 5>>(run, c);
        default: return run_effects_on<R, ObserverPlant<R, -1>>(run, c);
    }
}

}  // namespace gaident
