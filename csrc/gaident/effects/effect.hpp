// What an effect is. Its header contains everything about it:
//
//     static constexpr EffectInfo info           its row in the table: name, place, meaning, parameters with units and ranges
//     static constexpr Hooks hooks               which of the functions with a dash below it has
//     static constexpr Pace pace                 how fine the substeps must be
//     template <class R> struct Coefficients     what the sample loop needs of the parameters: members of type R; absent: none
//     static void prepare(p, PreparedFor, c)          parameters -> coefficients; absent where there are none
//     template <class R> struct State            its memory, all zero where the record begins; absent: none
//     static constexpr bool apart = true         where its state is not in the loop's own (registry.hpp); absent: it is
//   - static double substeps(p, Circumstances)   how many a sample it asks for beyond its pace
//
// and a hook, the place in the loop where it acts; those of a shaft effect are asked at the motor, or at the load (at_load.hpp).
// R is double or lanes of doubles; on R there are selections and no branches.
//
//   - command             r' = command(c, s, r)                  what the controller is asked to follow [rad/s]
//   - controller          controller(c, pi)                      once: its limits
//   - actuator            u' = actuator(c, u)                    the torque issued, once a control step [N m]
//   - actuator_dynamics   T = actuator_dynamics(c, s, past, T)   its course over the substep [N m]
//   - torque              T' = T - torque(c, theta)              a torque that brakes, at the angle theta [rad]
//   - torque_apart        T' = T - torque_apart(c, theta)        the same in a call of its own, which no other effect pays for
//   - torque_of_time      T' = T - torque_of_time(c, t)          one that is known by the time t [s] alone
//   - inertia             inertia(c, theta, step)                what a change of the inertia does to the substep's equation; at the
//                                                                load of two masses, else at the motor
//   - law                 law(c, friction)                       once: its part of the friction law that is constant
//   - level               level(c, t)                            dry friction known by the time t [s] alone [N m]
//   - level_of_angle      level_of_angle(c, theta)               dry friction known by the angle theta [rad] alone [N m]
//   - loaded              loaded(c, load)                        dry friction known by what the torque hooks brake with [N m]
//   - friction            friction(c, s, step)                   what its friction changes in the substep's equation
//   - after_friction      after_friction(c, s, step, w_next)     and once its velocity is known; may be absent
//   - coupling            coupling, mean_coupling, loaded_twist  a nonlinear coupling of two masses (mechanism.hpp)
//   - hysteresis          wound, mean_wound, loaded_twist        a coupling of two masses with a memory (mechanism.hpp)
//   - sensor              w' = sensor(c, theta, w)               the velocity as it is measured [rad/s]
//   - sensor_apart        w' = sensor_apart(c, theta, w)         the same in a call of its own
//   - sensor_dynamics     y = sensor_dynamics(c, s, w, bend)     the same filtered, once a substep, its output kept as s.output;
//                                                                bend: by how much its mean over the substep is above that of its ends
//   - reading             y' = reading(c, y)                     the number read from it, once a sample
//   - plant               plant(p, linear)                       the mechanism changed, linearly
//
// An effect may also have
//
//   - begin(c, s, Beginning)   its state where the record begins: in motion, or under a torque
//   - possible(p)              false where there is no such drive
//   - bend_behind(c, before, s, bend)   the bend of what its sensor_dynamics gave, of its states before and behind the substep
//   - tabulate(p, PreparedFor, t)   makes a `Table` t for what is not a number per lane; reach(t, steps): how many torques back it looks
//   - later(p, delay)          its parameters with the controller's delay [s] added: so it acts where it is not in the model, too
//
// The compiler compares `hooks` with the functions that are there (registry.hpp).
// One that is misspelt, or takes other arguments, is an error, and so is an effect that has no function that acts at its place,
// no pace, or coefficients that nothing prepares.
// Neutral parameters make an effect the identity. Effects do not know one another.
#pragma once

#include "../control/closed_loop.hpp"
#include "../numeric/elementary.hpp"

#include <cstdint>
#include <limits>
#include <span>

namespace gaident {

enum class Place { shaft, mechanism, coupling, actuator, controller, sensor, plant, record };

// The functions that an effect may have, a bit each.
enum class Hooks : std::uint32_t {
    none = 0,
    command = 1U << 0,
    controller = 1U << 1,
    actuator = 1U << 2,
    actuator_dynamics = 1U << 3,
    torque = 1U << 4,
    law = 1U << 5,
    level = 1U << 6,
    friction = 1U << 7,
    after_friction = 1U << 8,
    coupling = 1U << 9,
    sensor = 1U << 10,
    sensor_dynamics = 1U << 11,
    reading = 1U << 12,
    plant = 1U << 13,
    begin = 1U << 14,
    substeps = 1U << 15,
    possible = 1U << 16,
    tabulate = 1U << 17,
    later = 1U << 18,
    loaded = 1U << 19,
    load = 1U << 20,
    level_of_angle = 1U << 21,
    hysteresis = 1U << 22,
    torque_of_time = 1U << 23,
    inertia = 1U << 24,
    torque_apart = 1U << 25,
    sensor_apart = 1U << 26,
};
constexpr Hooks operator|(Hooks a, Hooks b) {
    return static_cast<Hooks>(static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b));
}
constexpr Hooks operator&(Hooks a, Hooks b) {
    return static_cast<Hooks>(static_cast<std::uint32_t>(a) & static_cast<std::uint32_t>(b));
}

// Of these an effect of friction has one.
inline constexpr Hooks dry_hooks = Hooks::law | Hooks::level | Hooks::level_of_angle | Hooks::loaded | Hooks::friction;

inline constexpr double infinite = std::numeric_limits<double>::infinity();
inline constexpr double any_value = std::numeric_limits<double>::quiet_NaN();

struct EffectParameter {
    const char* name = nullptr;
    const char* unit = "";
    double neutral = any_value;  // the effect is the identity where every parameter that has a neutral value has it
    double lowest = -infinite, highest = infinite;
    bool above_lowest = false;  // the lowest value itself is excluded
};

struct EffectInfo {
    const char* name;
    Place place;
    const char* meaning;  // one clause; {torque}, {per turn}: a linear axis has other words, see python/gaident/axis.py
    std::span<const EffectParameter> parameters;
    bool simulated = true;
    bool needs_two_masses = false;
    bool turns = false;                         // depends on the shaft's angle
    bool (*identity)(const double*) = nullptr;  // where being neutral is a relation between parameters
    bool (*allowed)(const double*) = nullptr;   // a relation that parameters have to meet,
    const char* relation = "";                  // in words
    const char* remark = "";                    // what the table says after the meaning
    bool at_load = false;                       // acts at the load of two masses (at_load.hpp)
    bool several_waves = false;                 // is another effect's with more waves than one (several_waves.hpp)

    constexpr int count() const { return static_cast<int>(parameters.size()); }

    constexpr bool neutral(const double* p) const {
        if (identity != nullptr) return identity(p);
        for (std::size_t i = 0; i < parameters.size(); ++i) {
            const double value = parameters[i].neutral;
            if (value == value && p[i] != value) return false;
        }
        return true;
    }
};

// Substeps per sample at most.
inline constexpr int max_substeps = 64;

// What coefficients are made for.
struct PreparedFor {
    double step;     // of the mechanism [s]
    double hold;     // how long a torque is held [s]
    int steps;       // while a torque is held
    int per_sample;  // in a sample of the controller, or of the record in the continuous loop
    double inertia;  // of the load where there are two masses, else of the motor's side [kg m^2]
    double torques;  // issued in the run, each held so long; infinity: it has no end
};

enum class Pace {
    sample,  // the effect is exact at any step
    fine,    // it acts between samples
    finer,   // it is part of a resonance, or drives one
};

// What an effect may look at to say how many substeps it needs.
struct Circumstances {
    const Factors<double>& plant;
    const Loop& loop;
    double sample_time, top_speed;         // [s], [rad/s]
    double inverse_inertia, inverse_load;  // of the motor's side and of the load's, 0 where there is none [1/(kg m^2)]

    // Substeps in which a shaft at the top speed turns little of one period.
    double for_turns(double order) const { return order * top_speed * sample_time / 0.3; }
};

// How things stood where the record began.
template <class R>
struct Beginning {
    R velocity, torque, command;  // rad/s, N m, rad/s
};

// A torque T over a substep h: its mean, and the rise of the straight line that has the same first moment:
//
//     mean = int_0^1 T(s h) ds,   rise = 12 int_0^1 (s - 1/2) T(s h) ds
//
// What a mechanism makes of both is off by O(h^3) where T jumps and by O(h^4) where it does not; of the mean alone, by O(h^2).
template <class R>
struct Course {
    R mean, rise;
};

// e^-x, and the mean and the rise of e^-(s x) over 0 <= s <= 1, for x >= 0 or infinite.
struct Decay {
    double power, mean, rise;

    explicit Decay(double x)
        : power(exp_of_minus(x)),
          mean(x < 0.5 ? series(x) : (1.0 - power) / x),
          rise(x < 0.5 ? rising(x) : 12.0 * ((mean - power) / x - 0.5 * mean)) {}

    static double series(double x) {
        double sum = 0.0;
        for (int k = 14; k >= 1; --k) sum = (1.0 - x * sum) / k;
        return sum;
    }
    static double rising(double x) {
        double sum = 1.0;
        for (int k = 14; k >= 1; --k) sum = 1.0 - x * sum * (k + 1.0) / (k * (k + 3.0));
        return -x * sum;
    }
};

}  // namespace gaident
