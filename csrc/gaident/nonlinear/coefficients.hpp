// What the loop with effects needs to know of one candidate (R = double) or of one per lane: the parameters as the sample loop
// uses them, for its substep.
// Numbers only, so that candidates are laid side by side without naming each.
#pragma once

#include "../effects/list.hpp"
#include "../plant/two_mass.hpp"

#include <cstring>
#include <type_traits>

namespace gaident {

// The ends of the shaft.
enum class Side { motor, load };

// call.operator()<Key, E>() for each effect of this side: E has its functions, under Key its coefficients and state are kept.
template <Side side, class Call>
[[gnu::always_inline]] inline void each_at(Call&& call) {
    if constexpr (side == Side::motor) {
        Effects::each([&]<class E>() __attribute__((always_inline)) { call.template operator()<E, E>(); });
    } else {
        LoadEffects::each([&]<class Key>()
                              __attribute__((always_inline)) { call.template operator()<Key, typename Key::AtMotor>(); });
    }
}

template <class R>
struct EffectConstants {
    // The plant in observer form at the substep, and its state at the record's start ...
    R a[max_plant_order], b[max_plant_order + 1], x[max_plant_order];
    // ... or two masses (two_mass.hpp)
    R phi[3][3], motor[3], coupling[3];
    R KG, DG, per_scale;
    // Of either, what is the same as a rise of the torque by 1: a torque, and so much more of the state's numbers from the second on
    R rise[max_plant_order];
    // The mean velocity over the substep beside that of its ends: of the state before it, the velocities at its end, the torque's rise
    R bend[max_plant_order], bend_end[2], bend_rise;

    typename Effects::Coefficients<R> effects;

    R stored;  // the controller's stored torque at the start
    R before;  // torque that acted before the record's start

    typename LoadEffects::Coefficients<R> at_load;

    // Those of an effect at its side.
    template <class E>
    auto& of() {
        if constexpr (hook::load<E>) return at_load.template of<E>();
        else return effects.template of<E>();
    }
    template <class E>
    const auto& of() const {
        return const_cast<EffectConstants&>(*this).template of<E>();
    }
};

inline constexpr std::size_t effect_constants = sizeof(EffectConstants<double>) / sizeof(double);

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
