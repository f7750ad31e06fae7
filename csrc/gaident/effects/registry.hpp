// What follows from a list of effects (list.hpp) and from what their headers say (effect.hpp).
// That is the table, which hooks an effect has, and the coefficients and states of all side by side.
#pragma once

#include "effect.hpp"
#include "friction/law.hpp"

#include <array>
#include <concepts>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace gaident {

enum class Effect : std::uint8_t {};

// One type for each effect, so that none of them takes memory.
template <class E>
struct Nothing {};

// An effect whose state stands apart from the loop's own: few models have it, it is large or its functions are calls, and the loop's
// state stays in registers.
template <class E>
concept Apart = requires { requires E::apart; };

namespace detail {

template <class E, class R>
struct CoefficientsOf {
    using Type = Nothing<E>;
};
template <class E, class R>
    requires requires { typename E::template Coefficients<R>; }
struct CoefficientsOf<E, R> {
    using Type = typename E::template Coefficients<R>;
};

template <class E, class R>
struct StateOf {
    using Type = Nothing<E>;
};
template <class E, class R>
    requires requires { typename E::template State<R>; }
struct StateOf<E, R> {
    using Type = typename E::template State<R>;
};

// Of an effect that is another at the load: empty members have a type of their own there, too.
template <class Here, class E, class R>
struct StateAt {
    using Type = Nothing<Here>;
};
template <class Here, class E, class R>
    requires requires { typename E::template State<R>; }
struct StateAt<Here, E, R> {
    using Type = typename E::template State<R>;
};

template <class E>
struct TableOf {
    using Type = Nothing<E>;
};
template <class E>
    requires requires { typename E::Table; }
struct TableOf<E> {
    using Type = typename E::Table;
};

template <bool here, class E, class R>
struct StateIf {
    using Type = Nothing<E>;
};
template <class E, class R>
struct StateIf<true, E, R> : StateOf<E, R> {};

// E tells apart effects whose members look alike.
template <class E, class Value>
struct Slot {
    [[no_unique_address]] Value value;
};

}  // namespace detail

template <class E, class R>
using CoefficientsOf = typename detail::CoefficientsOf<E, R>::Type;
template <class E, class R>
using StateOf = typename detail::StateOf<E, R>::Type;
template <class E>
using TableOf = typename detail::TableOf<E>::Type;

template <class E>
concept HasTable = requires { typename E::Table; };
template <class E>
concept HasCoefficients = requires { typename E::template Coefficients<double>; };

// Which hooks an effect has.
namespace hook {

template <class E>
using C = const CoefficientsOf<E, double>&;
template <class E>
using S = StateOf<E, double>&;
struct Past {
    std::size_t newest;
    int substep;
    double torque(std::size_t at, std::size_t lane) const;
    template <class E>
    const typename E::Table& table(std::size_t lane) const;
};

template <class E>
concept command = requires(C<E> c, S<E> s, double x) { E::command(c, s, x); };
template <class E>
concept controller = requires(C<E> c, ControllerState<double>& pi) { E::controller(c, pi); };
template <class E>
concept actuator = requires(C<E> c, double x) { E::actuator(c, x); };
template <class E>
concept actuator_dynamics = requires(C<E> c, S<E> s, const Past& past, Course<double> T) { E::actuator_dynamics(c, s, past, T); };
template <class E>
concept torque = requires(C<E> c, double x) { E::torque(c, x); };
template <class E>
concept torque_apart = requires(C<E> c, double x) { E::torque_apart(c, x); };
template <class E>
concept torque_of_time = requires(C<E> c, double x) { E::torque_of_time(c, x); };
template <class E>
concept inertia = requires(C<E> c, FrictionStep<double>& step, double x) { E::inertia(c, x, step); };
template <class E>
concept law = requires(C<E> c, FrictionLaw<double>& sum) { E::law(c, sum); };
template <class E>
concept level = requires(C<E> c, double x) { E::level(c, x); };
template <class E>
concept level_of_angle = requires(C<E> c, double x) { E::level_of_angle(c, x); };
template <class E>
concept loaded = requires(C<E> c, double x) { E::loaded(c, x); };
template <class E>
concept friction = requires(C<E> c, S<E> s, FrictionStep<double>& step) { E::friction(c, s, step); };
template <class E>
concept after_friction =
    requires(C<E> c, S<E> s, const FrictionStep<double>& step, double x) { E::after_friction(c, s, step, x); };
template <class E>
concept coupling = requires(C<E> c, double x) {
    E::coupling(c, x, x, x, x);
    E::mean_coupling(c, x, x, x, x, x);
    E::loaded_twist(c, x, x, x);
};
template <class E>
concept hysteresis = requires(C<E> c, S<E> s, double x) {
    E::wound(c, s, x);
    E::mean_wound(c, s, x);
    E::loaded_twist(c, x, x, x);
};
template <class E>
concept sensor = requires(C<E> c, double x) { E::sensor(c, x, x); };
template <class E>
concept sensor_apart = requires(C<E> c, double x) { E::sensor_apart(c, x, x); };
template <class E>
concept sensor_dynamics = requires(C<E> c, S<E> s, double x) { E::sensor_dynamics(c, s, x, x); };
template <class E>
concept bend_behind = requires(C<E> c, S<E> s, double x) { E::bend_behind(c, s, s, x); };
template <class E>
concept reading = requires(C<E> c, double x) { E::reading(c, x); };
template <class E>
concept plant = requires(const double* p, const Factors<double>& g) { E::plant(p, g); };
template <class E>
concept begin = requires(C<E> c, S<E> s, const Beginning<double>& b) { E::begin(c, s, b); };
template <class E>
concept substeps = requires(const double* p, const Circumstances& at) { E::substeps(p, at); };
template <class E>
concept possible = requires(const double* p) { E::possible(p); };
template <class E>
concept tabulate = HasTable<E> && requires(const double* p, const PreparedFor& time, TableOf<E>& table) {
    E::tabulate(p, time, table);
    E::reach(table, time.steps);
};
template <class E>
concept later = requires(double* p, double delay) { E::later(p, delay); };
template <class E>
concept load = requires { typename E::AtMotor; };  // another effect's, at the load (at_load.hpp)

// What every effect has, not listed in `hooks`.
template <class E>
concept pace = requires {
    { E::pace } -> std::same_as<const Pace&>;
};
template <class E>
concept prepare = requires(const double* p, const PreparedFor& time, CoefficientsOf<E, double>& c) { E::prepare(p, time, c); };

template <class E>
constexpr Hooks all_of() {
    const auto if_there = [](bool there, Hooks h) { return there ? h : Hooks::none; };
    return if_there(command<E>, Hooks::command) | if_there(controller<E>, Hooks::controller) |
           if_there(actuator<E>, Hooks::actuator) | if_there(actuator_dynamics<E>, Hooks::actuator_dynamics) |
           if_there(torque<E>, Hooks::torque) | if_there(law<E>, Hooks::law) | if_there(level<E>, Hooks::level) |
           if_there(level_of_angle<E>, Hooks::level_of_angle) | if_there(hysteresis<E>, Hooks::hysteresis) |
           if_there(loaded<E>, Hooks::loaded) | if_there(friction<E>, Hooks::friction) |
           if_there(after_friction<E>, Hooks::after_friction) | if_there(coupling<E>, Hooks::coupling) |
           if_there(sensor<E>, Hooks::sensor) | if_there(sensor_dynamics<E>, Hooks::sensor_dynamics) |
           if_there(reading<E>, Hooks::reading) | if_there(plant<E>, Hooks::plant) | if_there(begin<E>, Hooks::begin) |
           if_there(substeps<E>, Hooks::substeps) | if_there(possible<E>, Hooks::possible) |
           if_there(tabulate<E>, Hooks::tabulate) | if_there(later<E>, Hooks::later) | if_there(load<E>, Hooks::load) |
           if_there(torque_of_time<E>, Hooks::torque_of_time) | if_there(inertia<E>, Hooks::inertia) |
           if_there(torque_apart<E>, Hooks::torque_apart) | if_there(sensor_apart<E>, Hooks::sensor_apart);
}

// Those of which an effect at this place has to have one.
constexpr Hooks acting_at(Place place) {
    switch (place) {
        case Place::shaft: return Hooks::torque | Hooks::torque_apart | Hooks::torque_of_time | dry_hooks | Hooks::load;
        case Place::mechanism: return Hooks::inertia;
        case Place::coupling: return Hooks::coupling | Hooks::hysteresis;
        case Place::actuator: return Hooks::actuator | Hooks::actuator_dynamics;
        case Place::controller: return Hooks::command | Hooks::controller;
        case Place::sensor: return Hooks::sensor | Hooks::sensor_apart | Hooks::sensor_dynamics | Hooks::reading;
        case Place::plant: return Hooks::plant;
        case Place::record: break;
    }
    return Hooks::none;
}

// Whether an effect does what it says. Its own type in the compiler's message says which one does not.
template <class E>
struct Checked {
    static_assert(
        all_of<E>() == E::hooks,
        "a function in the effect's `hooks` is missing, misspelt or takes other arguments, or one that it has is not listed");
    static_assert(!E::info.simulated || (E::hooks & acting_at(E::info.place)) != Hooks::none,
                  "the effect has no function that acts at its place");
    static_assert(pace<E>, "the effect's `pace` is missing, misspelt or no Pace");
    static_assert(prepare<E> == HasCoefficients<E>,
                  "the effect's `prepare` or its `Coefficients` are missing, misspelt, or do not go together");
    static constexpr bool right = true;
};

}  // namespace hook

template <class... E>
struct EffectList {
    static_assert((hook::Checked<E>::right && ...));
    static constexpr int size = sizeof...(E);
    static constexpr std::array<EffectInfo, sizeof...(E)> table{E::info...};
    static constexpr int parameters = (0 + ... + E::info.count());
    static constexpr std::array<int, sizeof...(E)> first_parameter = [] {
        std::array<int, sizeof...(E)> first{};
        int sum = 0;
        for (std::size_t i = 0; i < sizeof...(E); ++i) {
            first[i] = sum;
            sum += table[i].count();
        }
        return first;
    }();

    template <class One>
    static constexpr Effect number = [] {
        std::uint8_t i = 0;
        static_cast<void>(((std::is_same_v<One, E> || (++i, false)) || ...));
        return static_cast<Effect>(i);
    }();

    // call.operator()<E>() for each effect, in the order of the list, unrolled.
    template <class Call>
    [[gnu::always_inline]] static constexpr void each(Call&& call) {
        (call.template operator()<E>(), ...);
    }
    // x through step.operator()<E>(x) of each effect.
    template <class R, class Step>
    [[gnu::always_inline]] static constexpr R chain(R x, Step&& step) {
        static_cast<void>(((x = step.template operator()<E>(x)), ...));
        return x;
    }
    template <class Call>
    static constexpr void each_backwards(Call&& call) {
        int unused = 0;
        static_cast<void>(((call.template operator()<E>(), unused) = ... = 0));
    }

    template <class R>
    struct Coefficients : detail::Slot<E, CoefficientsOf<E, R>>... {
        template <class One>
        [[gnu::always_inline]] CoefficientsOf<One, R>& of() {
            return static_cast<detail::Slot<One, CoefficientsOf<One, R>>&>(*this).value;
        }
        template <class One>
        [[gnu::always_inline]] const CoefficientsOf<One, R>& of() const {
            return static_cast<const detail::Slot<One, CoefficientsOf<One, R>>&>(*this).value;
        }
    };
    // The states in the loop's own, or those that stand apart.
    template <class R, bool apart>
    struct StatesOf : detail::Slot<E, typename detail::StateIf<Apart<E> == apart, E, R>::Type>... {
        template <class One>
        using Of = typename detail::StateIf<Apart<One> == apart, One, R>::Type;
        template <class One>
        [[gnu::always_inline]] Of<One>& of() {
            return static_cast<detail::Slot<One, Of<One>>&>(*this).value;
        }
        template <class One>
        [[gnu::always_inline]] const Of<One>& of() const {
            return static_cast<const detail::Slot<One, Of<One>>&>(*this).value;
        }
    };
    template <class R>
    using States = StatesOf<R, false>;
    template <class R>
    using StatesApart = StatesOf<R, true>;
    struct Tables : detail::Slot<E, TableOf<E>>... {
        template <class One>
        [[gnu::always_inline]] const TableOf<One>& of() const {
            return static_cast<const detail::Slot<One, TableOf<One>>&>(*this).value;
        }
        template <class One>
        TableOf<One>& of() {
            return static_cast<detail::Slot<One, TableOf<One>>&>(*this).value;
        }
    };
};

}  // namespace gaident
