// The closed loop with effects at their places, written once for one candidate (R = double) and for lanes of candidates that have the same
// effects with different parameters; every lane equals the scalar bit for bit.
// Which effects there are is the same for all lanes and may be asked with a branch; on numbers there are selections only.
// The loop names no effect: it runs over the list (effects/list.hpp) at each hook (effects/effect.hpp).
// The chain, with a user's own effects (own_effects.hpp) at those marked with a star:
//
//     *command -> controller -> *actuator -> actuator_dynamics -> *torque -> coupling, *friction -> *sensor -> sensor_dynamics -> reading
//
// One sample is `substeps` steps of h.
// In the sampled and the open loop the torque is held over the sample; in the continuous one the controller acts every substep
// on the linearly interpolated command, and its torque is extrapolated to the substep's mean (third order).
#pragma once

#include "../control/servo.hpp"
#include "effect_run.hpp"
#include "load_side.hpp"
#include "mechanism.hpp"
#include "sample_mean.hpp"

#include <span>
#include <type_traits>
#include <variant>

namespace gaident {

// Control: ControllerState, or Servo.
template <class R, class Plant, class Control>
class EffectLoop {
    static constexpr bool is_servo = std::same_as<Control, Servo<R>>;

public:
    using Apart = typename Effects::StatesApart<R>;

    [[gnu::always_inline]] EffectLoop(const EffectRun& run, const EffectConstants<R>& constants, Apart& apart)
        : run_(run),
          c_(constants),
          apart_(apart),
          plant_(constants, run.order),
          pi_(controller_of(run)),
          own_(run, plant_.velocity()),
          load_(run, plant_.twist()) {
        const bool continuous = run.loop.kind == LoopKind::continuous;
        h_ = run.sample_time / run.substeps;
        if constexpr (!is_servo)
            if (continuous) pi_ = ControllerState<R>(run.loop.controller, Clock{h_});
        // A change of the inertia is in the equation that friction is in, at the end where it acts.
        constexpr bool changing = Plant::changing && !Plant::both_ends;
        dry_ = run.effects.meets(effects_with(changing ? dry_hooks | Hooks::inertia : dry_hooks)) || own_.friction();
        beside_ = run.effects.meets(effects_with(Hooks::torque_of_time | Hooks::torque_apart)) || own_.shaft();
        bent_ = run.effects.meets(effects_with(Hooks::sensor_apart)) || own_.sensor();
        turning_ = run.effects.meets(effects_that_turn()) || own_.there();
        looking_back_ = run.effects.meets(effects_with(Hooks::tabulate));
        shaping_ = run.effects.meets(effects_with(Hooks::command)) || own_.command();
        held_ = c_.before;
        const R given = first_command(), w = plant_.velocity();
        const R followed = own_.command() ? own_.followed(run, given, w, R(run.start_angle), held_, 0.0) : given;
        const Beginning<R> start{w, c_.before, followed};
        Effects::each([&]<class E>() __attribute__((always_inline)) {
            if (!run_.effects.has<E>()) return;
            const auto& c = c_.effects.template of<E>();
            if constexpr (hook::controller<E>) E::controller(c, pi_);
            if constexpr (hook::law<E>) E::law(c, law_);
            if constexpr (hook::begin<E> && asks<E>) E::begin(c, state<E>(), start);
        });
        if constexpr (Plant::both_ends) begin_at_load();
        if constexpr (!is_servo) pi_.s = c_.stored;
        else if (run.moving) pi_.rest(given, followed, w, c_.stored);
        if (filtering() || averaging()) before_.state = plant_.seen();
        angle_ = R(run.start_angle);
        theta_middle_ = fma(plant_.velocity(), R(0.5 * h_), angle_);
        if (looking_back_)
            for (std::size_t i = 0; i <= run.history_mask; ++i) Pack<R>::store(c_.before, run.history + i * width);
        // Friction cannot drive the shaft: a candidate with such a friction counts as diverged.
        if (dry_) plant_.x[0] = greater(plant_.beta(), R(0.0), plant_.x[0], R(any_value));
        per_beta_ = R(1.0) / plant_.beta();
    }

    [[gnu::always_inline]] void operator()() {
        if (run_.loop.kind == LoopKind::continuous) continuous();
        else held();
    }

private:
    static constexpr std::size_t width = static_cast<std::size_t>(Pack<R>::width);

    static Control controller_of(const EffectRun& run) {
        if constexpr (is_servo) return Control(run.loop.controller, run.loop.servo, run.sample_time);
        else return Control(run.loop.controller, Clock{run.sample_time});
    }

    // The velocity command where the record begins in motion; under a position controller the velocity, which it keeps.
    R first_command() const {
        if (!run_.moving || run_.input.empty()) return R(0.0);
        if constexpr (is_servo)
            if (run_.loop.servo.position_gain > 0.0) return plant_.velocity();
        return R(run_.input[0]);
    }

    [[gnu::always_inline]] void held() {
        const bool open = run_.loop.kind == LoopKind::open;
        const double share = 1.0 / run_.substeps;
        for (std::size_t n = 0; n < run_.input.size(); ++n) {
            if (run_.ends_at(n)) [[unlikely]]
                return;
            const double here = run_.position_at(n), next = run_.position_after(n);
            theta_ = run_.position.empty() ? angle_ : R(here);
            time_ = static_cast<double>(n) * run_.sample_time;
            const R y = sensor_over_sample();
            const R u = open ? R(run_.input[n]) : control_at(n, y);
            if constexpr (!is_servo) write(n, y, u);
            else if (n % static_cast<std::size_t>(run_.log_every) == 0) write(n / static_cast<std::size_t>(run_.log_every), y, u);
            act(u);
            for (int j = 0; j < run_.substeps; ++j) {
                middle(here, next, (j + 0.5) * share);
                substep(j, (static_cast<double>(n) + (j + 0.5) * share) * run_.sample_time);
                if (filtering() || averaging()) {
                    theta_ = run_.position.empty() ? angle_ : R(here + (next - here) * ((j + 1) * share));
                    time_ = (static_cast<double>(n) + (j + 1) * share) * run_.sample_time;
                    behind_substep(j);
                }
            }
        }
    }

    // What the controller reads: of a drive that takes the difference of its encoder's angle for the velocity, the mean over the sample.
    [[gnu::always_inline]] R sensor_over_sample() {
        if constexpr (is_servo)
            if (run_.averaged) return reading(mean_.at_sample(sensed(), run_.substeps, run_.in_pairs));
        return sensor();
    }

    // What a sensor makes of the velocity over a substep.
    [[gnu::always_inline]] void behind_substep(int j) {
        R bend = before_.bend(c_, plant_.seen());
        if constexpr (!is_servo) {
            filter(bend);
        } else {
            // The angle that is differenced is the one that it integrates.
            if (run_.averaged) angle_ = fma(bend, R(h_), angle_);
            if (filtering()) bend = filter(bend);
            if (!run_.averaged) return;
            if (!run_.in_pairs) mean_.over_substep(bend);
            if (j + 1 == run_.substeps) return;
            if (run_.in_pairs) mean_.behind_one_of_pair(j, sensed());
            else mean_.behind_substep(sensed());
        }
    }

    [[gnu::always_inline]] void continuous() {
        const double share = 1.0 / run_.substeps;
        double r_before = run_.moving && !run_.input.empty() ? run_.input[0] : 0.0;
        R u_before = c_.before, u_long_before = c_.before;
        theta_ = run_.position.empty() ? angle_ : R(run_.position_at(0));
        R y = sensor(), u = control(R(r_before), y);
        for (std::size_t n = 0; n < run_.input.size(); ++n) {
            if (run_.ends_at(n)) [[unlikely]]
                return;
            const double r = run_.input[n], here = run_.position_at(n > 0 ? n - 1 : 0), next = run_.position_at(n);
            const int steps = n == 0 && run_.moving ? 0 : run_.substeps;
            for (int j = 0; j < steps; ++j) {
                // Adams and Bashforth's mean over the substep to come.
                act(fma(u, R(23.0 / 12.0), fnma(u_before, R(16.0 / 12.0), u_long_before * R(5.0 / 12.0))));
                middle(here, next, (j + 0.5) * share);
                substep(0, (static_cast<double>(n) - 1.0 + (j + 0.5) * share) * run_.sample_time);
                theta_ = run_.position.empty() ? angle_ : R(here + (next - here) * ((j + 1) * share));
                time_ = (static_cast<double>(n) - 1.0 + (j + 1) * share) * run_.sample_time;
                if (filtering()) behind_substep(j);
                y = sensor();
                u_long_before = u_before;
                u_before = u;
                u = control(R(r_before + (r - r_before) * ((j + 1) * share)), y);
            }
            r_before = r;
            write(n, y, u);
        }
    }

    void begin_at_load() {
        plant_.correcting = run_.effects.meets(effects_with(Hooks::coupling | Hooks::hysteresis));
        plant_.remembering = run_.effects.meets(effects_with(Hooks::hysteresis));
        const Beginning<R> start{plant_.load_velocity(), c_.before, first_command()};
        each_at<Side::load>([&]<class Key, class E>() {
            if (!run_.effects.has<Key>()) return;
            const auto& c = c_.template of<Key>();
            if constexpr (hook::law<E>) E::law(c, load_.law);
            if constexpr (hook::begin<E>) E::begin(c, load_.states.template of<Key>(), start);
        });
        turning_ = turning_ || load_.turning;
        load_.own.begin(plant_.load_velocity());
        // As for friction at the motor; where the step is too coarse for the resonance both ends cannot be solved.
        if (load_.dry) {
            const R alone = fnma(plant_.back() / plant_.beta(), plant_.across(), plant_.load_beta());
            plant_.x[0] = greater(minimum(plant_.load_beta(), alone), R(0.0), plant_.x[0], R(any_value));
        }
    }

    // theta in the middle of the substep
    [[gnu::always_inline]] void middle(double here, double next, double share) {
        if (!turning_) return;
        if (!run_.position.empty()) {
            theta_ = R(here + (next - here) * share);
            return;
        }
        // Predicted a substep ahead (second order), so that the sine is computed in time.
        theta_ = theta_middle_;
        theta_middle_ = fma(plant_.velocity(), R(1.5 * h_), angle_);
    }

    [[gnu::always_inline]] void write(std::size_t n, R y, R u) {
        n %= effect_block;
        if (run_.velocity != nullptr) Pack<R>::store(y, run_.velocity + n * width);
        if (run_.torque != nullptr) Pack<R>::store(u, run_.torque + n * width);
        if (run_.angle != nullptr) Pack<R>::store(angle_, run_.angle + n * width);
        if constexpr (Plant::both_ends) {
            if (run_.load_velocity == nullptr) return;
            Pack<R>::store(plant_.load_velocity(), run_.load_velocity + n * width);
            Pack<R>::store(load_.twist_at_start - plant_.twist(), run_.load_lag + n * width);
        }
    }

    // What the sensor measures, before it is filtered.
    [[gnu::always_inline]] R measured() const {
        R w = plant_.velocity();
        if (OwnInLoop<R>::asks && bent_) [[unlikely]]
            w = measured_apart(run_, c_, w, theta_, held_, time_);
        return Effects::chain(w, [&]<class E>(R x) __attribute__((always_inline)) {
            if constexpr (hook::sensor<E>)
                if (run_.effects.has<E>()) return E::sensor(c_.effects.template of<E>(), theta_, x);
            return x;
        });
    }

    // Whether this loop has the effect at all.
    template <class E>
    static constexpr bool asks = OwnInLoop<R>::asks || !gaident::Apart<E>;

    template <class E>
    [[gnu::always_inline]] auto& state() {
        if constexpr (gaident::Apart<E>) return apart_.template of<E>();
        else return states_.template of<E>();
    }
    template <class E>
    [[gnu::always_inline]] const auto& state() const {
        if constexpr (gaident::Apart<E>) return apart_.template of<E>();
        else return states_.template of<E>();
    }

    // Whether an effect has dynamics before the mechanism, or behind it. In the loop of one candidate none has (effects/list.hpp).
    [[gnu::always_inline]] bool late() const {
        return OwnInLoop<R>::asks && run_.effects.meets(effects_with(Hooks::actuator_dynamics));
    }
    [[gnu::always_inline]] bool filtering() const {
        return OwnInLoop<R>::asks && run_.effects.meets(effects_with(Hooks::sensor_dynamics));
    }
    [[gnu::always_inline]] bool averaging() const { return is_servo && run_.averaged; }
    // The filters, and the bend of what they give; in the other loops a filter behind another takes a straight line.
    [[gnu::always_inline]] R filter(R bend) {
        Effects::chain(measured(), [&]<class E>(R x) __attribute__((always_inline)) {
            if constexpr (hook::sensor_dynamics<E> && asks<E>)
                if (run_.effects.has<E>()) [[likely]] {
                    const auto& c = c_.effects.template of<E>();
                    auto& s = state<E>();
                    if constexpr (is_servo && hook::bend_behind<E>) {
                        const auto before = s;
                        x = E::sensor_dynamics(c, s, x, bend);
                        bend = E::bend_behind(c, before, s, bend);
                    } else {
                        x = E::sensor_dynamics(c, s, x, bend);
                        bend = R(0.0);
                    }
                }
            return x;
        });
        return bend;
    }

    // Of the last filter there is.
    [[gnu::always_inline]] R filter_output() const {
        return Effects::chain(plant_.velocity(), [&]<class E>(R x) __attribute__((always_inline)) {
            if constexpr (hook::sensor_dynamics<E> && asks<E>)
                if (run_.effects.has<E>()) return R(state<E>().output);
            return x;
        });
    }

    // What the sensor shows, before it is rounded.
    [[gnu::always_inline]] R sensed() const { return filtering() ? filter_output() : measured(); }
    [[gnu::always_inline]] R sensor() const { return reading(sensed()); }
    [[gnu::always_inline]] R reading(R y) const {
        return Effects::chain(y, [&]<class E>(R x) __attribute__((always_inline)) {
            if constexpr (hook::reading<E>)
                if (run_.effects.has<E>()) return E::reading(c_.effects.template of<E>(), x);
            return x;
        });
    }

    [[gnu::always_inline]] R control_at(std::size_t n, R y) {
        if constexpr (is_servo) {
            const auto fed = [&](std::span<const double> signal) { return R(signal.empty() ? 0.0 : signal[n]); };
            const R r = pi_.command(n, R(run_.input[n]), fed(run_.velocity_feedforward), angle_);
            return pi_.torque(shaped(r), y, fed(run_.torque_feedforward));
        } else {
            return control(R(run_.input[n]), y);
        }
    }

    [[gnu::always_inline]] R control(R r, R y) { return pi_.step(shaped(r) - y); }

    // The velocity command as the effects let it pass.
    [[gnu::always_inline]] R shaped(R r) {
        if constexpr (OwnInLoop<R>::asks) {  // one question where neither the user's own effects nor others shape it
            if (!shaping_) [[likely]]
                return r;
            if (own_.command()) [[unlikely]]
                r = own_.followed(run_, r, plant_.velocity(), theta_, held_, time_);
        }
        return Effects::chain(r, [&]<class E>(R x) __attribute__((always_inline)) {
            if constexpr (hook::command<E>)
                if (run_.effects.has<E>()) return E::command(c_.effects.template of<E>(), states_.template of<E>(), x);
            return x;
        });
    }

    // The torque u is issued, to be held until the next.
    [[gnu::always_inline]] void act(R u) {
        if (own_.actuator()) [[unlikely]]
            u = own_.asked(run_, OwnPlace::actuator, plant_.velocity(), theta_, u, time_);
        u = Effects::chain(u, [&]<class E>(R x) __attribute__((always_inline)) {
            if constexpr (hook::actuator<E>)
                if (run_.effects.has<E>()) return E::actuator(c_.effects.template of<E>(), x);
            return x;
        });
        held_ = u;
        if (looking_back_) {
            ++issued_;
            Pack<R>::store(u, run_.history + (issued_ & run_.history_mask) * width);
        }
    }

    // A substep of the mechanism under the torque that is held, and its parts: effect_substep.hpp, which a user of the loop includes.
    void substep(int j, double t);
    // The angle in the middle of the substep.
    template <Side side>
    [[gnu::always_inline]] R angle_at() const {
        if constexpr (side == Side::motor) return theta_;
        else return load_.theta;
    }
    template <Side side, class States>
    R under_friction(States& states, const FrictionLaw<R>& law, const FreeEnd<R>& end, double t);
    R move_both(R T, R w, double t);
    template <Side side, class States>
    R apart(States& states, const FrictionLaw<R>& law, const FreeEnd<R>& end, double t);

    const EffectRun& run_;
    const EffectConstants<R>& c_;
    Apart& apart_;
    Plant plant_;
    Control pi_;
    double h_, time_ = 0.0;
    bool dry_, turning_, looking_back_, shaping_;
    bool beside_;  // whether torques of the time, of several waves or of the user's own effects act at the motor
    bool bent_;    // whether several waves of the sensor, or the user's own effects, change what it measures
    OwnInLoop<R> own_;
    typename Effects::States<R> states_{};  // all zero
    FrictionLaw<R> law_;
    [[no_unique_address]] std::conditional_t<Plant::both_ends, LoadSide<R>, NoLoadSide> load_;
    R angle_, theta_ = R(0.0), theta_middle_;
    R held_ = R(0.0), friction_torque_ = R(0.0), per_beta_;
    SeenBefore<R, Plant::capacity> before_{};  // where something filters the velocity
    [[no_unique_address]] std::conditional_t<is_servo, SampleMean<R>, std::monostate> mean_;
    std::size_t issued_ = 0;
};

}  // namespace gaident
