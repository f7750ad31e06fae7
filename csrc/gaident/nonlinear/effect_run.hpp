// One run of the loop with effects: what its lanes have in common, the torques that it looks back on, and a user's own effects in it.
#pragma once

#include "coefficients.hpp"
#include "own_effects.hpp"

#include <span>

namespace gaident {

// Samples of the input after which what was written is taken; in 64 substeps each some milliseconds.
inline constexpr std::size_t effect_block = 1024;

// Takes what a run has written so far, block by block, so that a long run needs little memory and can be ended from outside.
class EffectSink {
public:
    virtual ~EffectSink() = default;
    // Before the input's sample n, a multiple of effect_block. Returns whether the run goes on.
    virtual bool take(std::size_t n) = 0;
};

// What lanes of one run have in common.
struct EffectRun {
    EffectSet effects;
    Loop loop;
    double sample_time = 0.0;  // of the controller
    int log_every = 1;         // outputs are written for the first of so many samples
    int substeps = 1;
    bool averaged = false;          // a servo differences an angle: the mean velocity over its sample is asked for,
    bool in_pairs = false;          // and taken of pairs of substeps (sample_mean.hpp)
    int order = 0;                  // of the plant in observer form
    bool two_masses = false;        // the coupling is not linear, or effects act at the load
    bool moving = false;            // the record does not start at rest
    std::span<const double> input;  // command, or torque in open loop
    std::span<const double> velocity_feedforward, torque_feedforward;  // of a servo, or empty
    std::span<const double> position;                                  // measured, or empty
    double start_angle = 0.0;

    // Written where not null, lanes side by side: the last effect_block logged samples, each at its number modulo that.
    double* velocity = nullptr;
    double* torque = nullptr;
    double* angle = nullptr;
    double* load_velocity = nullptr;  // of the load of two masses, and the next with it
    double* load_lag = nullptr;

    const Effects::Tables* tables = nullptr;  // one per lane
    double* history = nullptr;                // past torques: (history_mask + 1) * width numbers
    std::size_t history_mask = 0;

    OwnEffects* own = nullptr;           // asked through these
    bool own_at_load = false;            // some of them at the load
    OwnSignals own_signals{};            // width numbers each,
    const double* own_answer = nullptr;  // and answering there

    EffectSink* sink = nullptr;

    // Whether the run ends before the sample n.
    [[gnu::always_inline]] bool ends_at(std::size_t n) const { return n % effect_block == 0 && !sink->take(n); }

    // The measured angle at a sample, and at the one after it [rad]; 0 where none was measured.
    [[gnu::always_inline]] double position_at(std::size_t n) const { return position.empty() ? 0.0 : position[n]; }
    [[gnu::always_inline]] double position_after(std::size_t n) const {
        if (position.empty()) return 0.0;
        const std::size_t last = position.size() - 1;
        if (n < last) return position[n + 1];
        return last == 0 ? position[0] : 2.0 * position[last] - position[last - 1];
    }
};

// The torques issued so far, as an effect of the actuator looks back on them.
struct PastTorques {
    const EffectRun& run;
    std::size_t width, newest;
    int substep;

    // Number `at`, counted as `newest` is.
    [[gnu::always_inline]] double torque(std::size_t at, std::size_t lane) const {
        return run.history[(at & run.history_mask) * width + lane];
    }
    template <class E>
    [[gnu::always_inline]] const typename E::Table& table(std::size_t lane) const {
        return run.tables[lane].template of<E>();
    }
};

// What brakes at an end of the shaft at the angle theta [N m] of effects that have calls of their own: called with values.
template <Side side, class R>
[[gnu::noinline]] R torque_apart(const EffectRun& run, const EffectConstants<R>& c, R theta) {
    R T = R(0.0);
    each_at<side>([&]<class Key, class E>() __attribute__((always_inline)) {
        if constexpr (hook::torque_apart<E>)
            if (run.effects.has<Key>()) T = T + E::torque_apart(c.template of<Key>(), theta);
    });
    return T;
}

// The dry friction at the motor's shaft that follows from the angle, itself or by what the effects there brake with, both in N m.
// apart: also of effects that have calls of their own.
template <bool apart, class R>
[[gnu::always_inline]] inline R loaded_level(const EffectRun& run, const EffectConstants<R>& c, R theta) {
    R load = R(0.0);
    // One question where a model has none of them.
    if (run.effects.meets(effects_with(Hooks::torque)))
        load = Effects::chain(load, [&]<class E>(R x) __attribute__((always_inline)) {
            if constexpr (hook::torque<E>)
                if (run.effects.has<E>()) return x + E::torque(c.effects.template of<E>(), theta);
            return x;
        });
    if constexpr (apart) load = load + torque_apart<Side::motor>(run, c, theta);
    return Effects::chain(R(0.0), [&]<class E>(R x) __attribute__((always_inline)) {
        if constexpr (hook::loaded<E>)
            if (run.effects.has<E>()) return x + E::loaded(c.effects.template of<E>(), load);
        if constexpr (hook::level_of_angle<E>)
            if (run.effects.has<E>()) return x + E::level_of_angle(c.effects.template of<E>(), theta);
        return x;
    });
}

// The same called with values: few models have it, and a candidate alone keeps its registers for a coupling (492 instructions
// a sample with backlash; 510 without the call).
template <bool apart, class R>
[[gnu::noinline]] R loaded_level_apart(const EffectRun& run, const EffectConstants<R>& c, R theta) {
    return loaded_level<apart>(run, c, theta);
}

// What brakes at an end of the shaft by the time t alone [N m], and the substep's equation under a change of the inertia.
// Called with values, for the same reason.
template <Side side, class R>
[[gnu::noinline]] R torque_of_time(const EffectRun& run, const EffectConstants<R>& c, R t) {
    R T = R(0.0);
    each_at<side>([&]<class Key, class E>() __attribute__((always_inline)) {
        if constexpr (hook::torque_of_time<E>)
            if (run.effects.has<Key>()) T = T + E::torque_of_time(c.template of<Key>(), t);
    });
    return T;
}
template <class R>
[[gnu::noinline]] FrictionStep<R> changed_inertia(const EffectRun& run, const EffectConstants<R>& c, R theta,
                                                  FrictionStep<R> step) {
    Effects::each([&]<class E>() __attribute__((always_inline)) {
        if constexpr (hook::inertia<E>)
            if (run.effects.has<E>()) E::inertia(c.effects.template of<E>(), theta, step);
    });
    return step;
}

// User-defined effects in the loop.
// Few models have them: what asks them is apart and called with values, so that the loop's own state may stay in registers.
// The loop of one candidate asks none, nor effects whose state stands apart or that know the time (`effects_in_lanes_only`): a single
// model with such effects runs in lanes, where the call costs the same.
template <class R>
class OwnInLoop {
public:
    static constexpr bool asks = Pack<R>::width > 1;

    OwnInLoop(const EffectRun& run, R w)
        : run_(run),
          command_(at(OwnPlace::command)),
          torque_(at(OwnPlace::torque)),
          friction_(at(OwnPlace::friction)),
          actuator_(at(OwnPlace::actuator)),
          sensor_(at(OwnPlace::sensor)),
          shaft_(torque_ || friction_),
          w_before_(w) {}

    bool there() const { return asks && run_.own != nullptr; }
    bool command() const { return asks && command_; }
    bool shaft() const { return asks && shaft_; }
    bool friction() const { return asks && friction_; }
    bool actuator() const { return asks && actuator_; }
    bool sensor() const { return asks && sensor_; }

    [[gnu::noinline]] static R asked(const EffectRun& run, OwnPlace place, R w, R theta, R u, double t) {
        Pack<R>::store(w, run.own_signals.velocity);
        Pack<R>::store(theta, run.own_signals.angle);
        Pack<R>::store(u, run.own_signals.torque);
        run.own->ask(place, t);
        return Pack<R>::load(run.own_answer);
    }

    // The velocity command r as those there let it pass; where others are asked the command is not known.
    [[gnu::noinline]] static R followed(const EffectRun& run, R r, R w, R theta, R u, double t) {
        Pack<R>::store(r, run.own_signals.command);
        r = asked(run, OwnPlace::command, w, theta, u, t);
        Pack<R>::store(R(no_command), run.own_signals.command);
        return r;
    }

    // The torque with that of the effects at the shaft, evaluated at the predicted mean velocity.
    [[gnu::always_inline]] R with_torque(R w, R theta, R T, double t) {
        const R middle = fma(w - w_before_, R(0.5), w);
        w_before_ = w;
        if (friction_) level_ = asked(run_, OwnPlace::friction, middle, theta, T, t > 0.0 ? t : 0.0);
        return torque_ ? T + asked(run_, OwnPlace::torque, middle, theta, T, t > 0.0 ? t : 0.0) : T;
    }
    // The friction evaluated with it [N m].
    R level() const { return level_; }

private:
    bool at(OwnPlace place) const { return there() && run_.own->at(place); }

    const EffectRun& run_;
    bool command_, torque_, friction_, actuator_, sensor_, shaft_;
    R w_before_, level_ = R(0.0);
};

// The velocity w as it is measured with a user's own effects and those that have calls of their own; theta: the angle, u: the torque.
template <class R>
[[gnu::noinline]] R measured_apart(const EffectRun& run, const EffectConstants<R>& c, R w, R theta, R u, double t) {
    if (run.own != nullptr && run.own->at(OwnPlace::sensor)) w = OwnInLoop<R>::asked(run, OwnPlace::sensor, w, theta, u, t);
    return Effects::chain(w, [&]<class E>(R x) __attribute__((always_inline)) {
        if constexpr (hook::sensor_apart<E>)
            if (run.effects.has<E>()) return E::sensor_apart(c.effects.template of<E>(), theta, x);
        return x;
    });
}

// Those at the load of two masses, for the loop that has one.
template <class R>
class OwnAtLoad {
public:
    explicit OwnAtLoad(const EffectRun& run)
        : torque_(at(run, OwnPlace::torque_at_load)), friction_(at(run, OwnPlace::friction_at_load)) {}

    bool there() const { return OwnInLoop<R>::asks && (torque_ || friction_); }
    bool friction() const { return OwnInLoop<R>::asks && friction_; }
    void begin(R w) { w_before_ = w; }

    // The torque that they add there, evaluated at the load's predicted mean velocity; u: the motor's torque.
    [[gnu::always_inline]] R torque(const EffectRun& run, R w, R theta, R u, double t) {
        const R middle = fma(w - w_before_, R(0.5), w);
        w_before_ = w;
        const double since = t > 0.0 ? t : 0.0;
        if (friction_) level_ = OwnInLoop<R>::asked(run, OwnPlace::friction_at_load, middle, theta, u, since);
        return torque_ ? OwnInLoop<R>::asked(run, OwnPlace::torque_at_load, middle, theta, u, since) : R(0.0);
    }
    // The friction evaluated with it [N m].
    R level() const { return level_; }

private:
    static bool at(const EffectRun& run, OwnPlace place) { return OwnInLoop<R>::asks && run.own_at_load && run.own->at(place); }

    bool torque_, friction_;
    R w_before_ = R(0.0), level_ = R(0.0);
};

}  // namespace gaident
