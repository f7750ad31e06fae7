// The closed loop with effects at their places, written once for one candidate (R = double) and for lanes of candidates that have the same
// effects with different parameters; every lane equals the scalar bit for bit. Which effects there are is the same for all lanes and may
// be asked with a branch; on numbers there are selections only. The chain:
//
//     command -> rate limit -> PI -> saturation -> dead band -> delay -> lag -> shaft -> mechanism -> ripple -> filter -> quantisation
//
// One sample is `substeps` steps of h. In the sampled and the open loop the torque is held over the sample; in the continuous one the
// controller acts every substep on the linearly interpolated command, and its torque is extrapolated to the substep's mean (third order).
#pragma once

#include "effect_plant.hpp"
#include "../effects/friction/law.hpp"
#include "own_effects.hpp"

#include <span>

namespace gaident {

// What lanes of one run have in common.
struct EffectRun {
    EffectSet effects;
    Loop loop;
    double sample_time = 0.0;
    int substeps = 1;
    int order = 0;                     // of the plant in observer form
    bool two_masses = false;           // the coupling is not linear
    bool moving = false;               // the record does not start at rest
    std::span<const double> input;     // command, or torque in open loop
    std::span<const double> position;  // measured, or empty
    double start_angle = 0.0;

    // Written where not null, lanes side by side: input.size() * width numbers.
    double* velocity = nullptr;
    double* torque = nullptr;
    double* angle = nullptr;

    const DelayTable* delay = nullptr;  // one per lane
    double* history = nullptr;          // past torques: (history_mask + 1) * width numbers
    std::size_t history_mask = 0;

    OwnEffects* own = nullptr;           // asked through these
    OwnSignals own_signals{};            // width numbers each,
    const double* own_answer = nullptr;  // and answering there
};

template <class R, class Plant>
class EffectLoop {
public:
    EffectLoop(const EffectRun& run, const EffectConstants<R>& constants)
        : run_(run), set_(run.effects), c_(constants), plant_(constants, run.order), pi_(run.loop, run.sample_time) {
        using enum Effect;
        const bool continuous = run.loop.kind == LoopKind::continuous;
        h_ = run.sample_time / run.substeps;
        if (continuous) pi_ = Controller<R>(run.loop, h_);
        if (set_.has(integrator_clamp)) pi_.integrator_limit = minimum(pi_.integrator_limit, c_.integrator_limit);
        pi_.s = c_.stored;
        friction_ = set_.has_any(coulomb_friction, stribeck_friction, asymmetric_friction, presliding_friction, quadratic_drag,
                                 friction_drift);
        steep_ = set_.has_any(asymmetric_friction, quadratic_drag);
        actuator_in_time_ = set_.has_any(transport_delay, torque_lag);
        turning_ = set_.has_any(unbalance, cogging, velocity_ripple) || run.own != nullptr;
        if (run.own != nullptr) {
            own_torque_ = run.own->at(OwnPlace::torque);
            own_friction_ = run.own->at(OwnPlace::friction);
            own_shaft_ = own_torque_ || own_friction_;
            own_actuator_ = run.own->at(OwnPlace::actuator);
            own_sensor_ = run.own->at(OwnPlace::sensor);
            friction_ = friction_ || own_friction_;
        }
        bristle_.torque = c_.bristle_torque;
        bristle_.stiffness = c_.bristle_stiffness;
        bristle_.per_break = c_.bristle_per_break;
        angle_ = R(run.start_angle);
        theta_middle_ = angle_ + plant_.velocity() * R(0.5 * h_);
        lagging_ = c_.before;
        filtered_ = filter_input_ = plant_.velocity();
        limited_command_ = R(run.moving && !run.input.empty() ? run.input[0] : 0.0);
        w_before_ = own_w_before_ = plant_.velocity();
        if (set_.has(transport_delay))
            for (std::size_t i = 0; i <= run.history_mask; ++i) Pack<R>::store(c_.before, run.history + i * width);
        // Friction that would push is no friction: such a candidate is as good as diverged.
        if (friction_) plant_.x[0] = greater(plant_.beta(), R(0.0), plant_.x[0], R(any_value));
        per_beta_ = R(1.0) / plant_.beta();
    }

    void operator()() {
        if (run_.loop.kind == LoopKind::continuous) continuous();
        else held();
    }

private:
    static constexpr std::size_t width = static_cast<std::size_t>(Pack<R>::width);

    void held() {
        const bool open = run_.loop.kind == LoopKind::open;
        const double share = 1.0 / run_.substeps;
        for (std::size_t n = 0; n < run_.input.size(); ++n) {
            const double here = position_at(n), next = position_after(n);
            theta_ = run_.position.empty() ? angle_ : R(here);
            time_ = static_cast<double>(n) * run_.sample_time;
            const R y = sensor();
            const R u = open ? R(run_.input[n]) : control(R(run_.input[n]), y);
            write(n, y, u);
            act(u);
            for (int j = 0; j < run_.substeps; ++j) {
                middle(here, next, (j + 0.5) * share);
                substep(j, (static_cast<double>(n) + (j + 0.5) * share) * run_.sample_time);
                if (set_.has(Effect::velocity_filter)) {
                    theta_ = run_.position.empty() ? angle_ : R(here + (next - here) * ((j + 1) * share));
                    time_ = (static_cast<double>(n) + (j + 1) * share) * run_.sample_time;
                    filter();
                }
            }
        }
    }

    void continuous() {
        const double share = 1.0 / run_.substeps;
        double r_before = run_.moving && !run_.input.empty() ? run_.input[0] : 0.0;
        R u_before = c_.before, u_long_before = c_.before;
        theta_ = run_.position.empty() ? angle_ : R(position_at(0));
        R y = sensor(), u = control(R(r_before), y);
        for (std::size_t n = 0; n < run_.input.size(); ++n) {
            const double r = run_.input[n], here = position_at(n > 0 ? n - 1 : 0), next = position_at(n);
            const int steps = n == 0 && run_.moving ? 0 : run_.substeps;
            for (int j = 0; j < steps; ++j) {
                // Adams and Bashforth's mean over the substep to come.
                act(u * R(23.0 / 12.0) - u_before * R(16.0 / 12.0) + u_long_before * R(5.0 / 12.0));
                middle(here, next, (j + 0.5) * share);
                substep(0, (static_cast<double>(n) - 1.0 + (j + 0.5) * share) * run_.sample_time);
                theta_ = run_.position.empty() ? angle_ : R(here + (next - here) * ((j + 1) * share));
                time_ = (static_cast<double>(n) - 1.0 + (j + 1) * share) * run_.sample_time;
                if (set_.has(Effect::velocity_filter)) filter();
                y = sensor();
                u_long_before = u_before;
                u_before = u;
                u = control(R(r_before + (r - r_before) * ((j + 1) * share)), y);
            }
            r_before = r;
            write(n, y, u);
        }
    }

    [[gnu::always_inline]] double position_at(std::size_t n) const { return run_.position.empty() ? 0.0 : run_.position[n]; }
    [[gnu::always_inline]] double position_after(std::size_t n) const {
        if (run_.position.empty()) return 0.0;
        const std::size_t last = run_.position.size() - 1;
        if (n < last) return run_.position[n + 1];
        return last == 0 ? run_.position[0] : 2.0 * run_.position[last] - run_.position[last - 1];
    }

    // theta in the middle of the substep
    [[gnu::always_inline]] void middle(double here, double next, double share) {
        if (!turning_) return;
        if (!run_.position.empty()) {
            theta_ = R(here + (next - here) * share);
            return;
        }
        // Foreseen a substep ahead (second order), so that its sine need not be waited for.
        theta_ = theta_middle_;
        theta_middle_ = angle_ + plant_.velocity() * R(1.5 * h_);
    }

    [[gnu::always_inline]] void write(std::size_t n, R y, R u) {
        if (run_.velocity != nullptr) Pack<R>::store(y, run_.velocity + n * width);
        if (run_.torque != nullptr) Pack<R>::store(u, run_.torque + n * width);
        if (run_.angle != nullptr) Pack<R>::store(angle_, run_.angle + n * width);
    }

    [[gnu::always_inline]] R rippled() const {
        R w = plant_.velocity();
        if (own_sensor_) [[unlikely]]
            w = asked(OwnPlace::sensor, w, held_, time_);
        if (!set_.has(Effect::velocity_ripple)) return w;
        return VelocityRipple::seen(c_.ripple_amplitude, c_.ripple_order, c_.ripple_phase, theta_, w);
    }

    [[gnu::always_inline]] void filter() {
        const R w = rippled();
        filtered_ = VelocityFilter::step(c_.filter_decay, c_.filter_old, c_.filter_new, filter_input_, w, filtered_);
        filter_input_ = w;
    }

    [[gnu::always_inline]] R sensor() const {
        const R y = set_.has(Effect::velocity_filter) ? filtered_ : rippled();
        return set_.has(Effect::velocity_quantisation) ? VelocityQuantisation::seen(c_.quantum, y) : y;
    }

    [[gnu::always_inline]] R control(R r, R y) {
        if (set_.has(Effect::command_rate_limit))
            r = limited_command_ = CommandRateLimit::follow(c_.rate_step, r, limited_command_);
        return pi_.step(r - y);
    }

    [[gnu::noinline]] R asked(OwnPlace place, R w, R u, double t) const {
        Pack<R>::store(w, run_.own_signals.velocity);
        Pack<R>::store(theta_, run_.own_signals.angle);
        Pack<R>::store(u, run_.own_signals.torque);
        run_.own->ask(place, t);
        return Pack<R>::load(run_.own_answer);
    }

    // The torque u is issued, to be held until the next.
    [[gnu::always_inline]] void act(R u) {
        using enum Effect;
        if (own_actuator_) [[unlikely]]
            u = asked(OwnPlace::actuator, plant_.velocity(), u, time_);
        if (set_.has(torque_saturation)) u = clamp(u, -c_.saturation, c_.saturation);
        if (set_.has(torque_dead_band)) u = TorqueDeadBand::step(c_.dead_band, u);
        held_ = u;
        if (set_.has(transport_delay)) {
            ++issued_;
            Pack<R>::store(u, run_.history + (issued_ & run_.history_mask) * width);
        }
    }

    [[gnu::always_inline]] R delayed(int j) const {
        alignas(64) double old[width], young[width], share[width];
        for (std::size_t lane = 0; lane < width; ++lane) {
            const DelayTable& table = run_.delay[lane];
            const std::size_t at = issued_ - static_cast<std::size_t>(table.back[j]);
            old[lane] = run_.history[(at & run_.history_mask) * width + lane];
            young[lane] = run_.history[((at + (table.back[j] > 0 ? 1U : 0U)) & run_.history_mask) * width + lane];
            share[lane] = table.share[j];
        }
        const R from = Pack<R>::load(old), to = Pack<R>::load(young);
        return from + (to - from) * Pack<R>::load(share);
    }

    [[gnu::always_inline]] void substep(int j, double t) {
        using enum Effect;
        R T = held_;
        if (actuator_in_time_) {
            if (set_.has(transport_delay)) T = delayed(j);
            if (set_.has(torque_lag)) T = TorqueLag::step(c_.lag_decay, c_.lag_mean, T, lagging_);
        }
        if (set_.has(load_torque)) T = T - c_.load;
        if (set_.has(unbalance)) T = T - Unbalance::torque(c_.unbalance_amplitude, c_.unbalance_phase, theta_);
        if (set_.has(cogging)) T = T - Cogging::torque(c_.cogging_amplitude, c_.cogging_order, c_.cogging_phase, theta_);

        const R w = plant_.velocity();
        if (own_shaft_) [[unlikely]]
            T = with_own(w, T, t);
        const R w_free = plant_.free_velocity(T, friction_torque_);
        R w_next = w_free;
        if (friction_) {
            w_next = under_friction(w, w_free, t);
            friction_torque_ = (w_free - w_next) * per_beta_;
            T = T - friction_torque_;
        }
        plant_.move(T, w_next);
        angle_ = angle_ + (w + w_next) * R(0.5 * h_);
    }

    // The torque with effects of one's own, asked at the mean velocity, which is foreseen. Apart, because it is seldom there.
    [[gnu::noinline]] R with_own(R w, R T, double t) {
        const R middle = w + (w - own_w_before_) * R(0.5);
        own_w_before_ = w;
        if (own_friction_) own_level_ = asked(OwnPlace::friction, middle, T, t > 0.0 ? t : 0.0);
        return own_torque_ ? T + asked(OwnPlace::torque, middle, T, t > 0.0 ? t : 0.0) : T;
    }

    [[gnu::always_inline]] R under_friction(R w, R w_free, double t) {
        using enum Effect;
        FrictionLaw<R> law = c_.law;
        if (own_friction_) {
            law.level_positive = law.level_positive + own_level_;
            law.level_negative = law.level_negative + own_level_;
        }
        R beta = plant_.beta();
        const bool bristle = set_.has(presliding_friction);
        if (bristle) bristle_.join(R(h_), w, other_friction_, w_free, beta);
        if (set_.has(friction_drift)) {
            const R level = FrictionDrift::level(c_.drift_torque, c_.drift_rate, R(t > 0.0 ? t : 0.0));
            law.level_positive = law.level_positive + level;
            law.level_negative = law.level_negative + level;
        }
        if (set_.has(stribeck_friction)) {
            // The level at the mean velocity, which is foreseen, but never beyond a stop: at rest the static level holds.
            const R zero = R(0.0), foreseen = w + (w - w_before_) * R(0.5);
            const R middle = greater(w * foreseen, zero, foreseen, zero);
            const R level = StribeckFriction::level(c_.stribeck_torque, c_.stribeck_static, c_.stribeck_slowness, middle);
            law.level_positive = law.level_positive + level;
            law.level_negative = law.level_negative + level;
            law.more_at_rest = c_.stribeck_static - level;
            w_before_ = w;
        }
        const R w_next = velocity_under_friction(law, w, w_free, beta, steep_);
        if (bristle) {
            other_friction_ = (w_free - w_next) / beta;
            bristle_.move(w, w_next);
        }
        return w_next;
    }

    const EffectRun& run_;
    const EffectSet set_;
    const EffectConstants<R>& c_;
    Plant plant_;
    Controller<R> pi_;
    double h_;
    bool friction_, steep_, actuator_in_time_, turning_;
    bool own_shaft_ = false, own_torque_ = false, own_friction_ = false, own_actuator_ = false, own_sensor_ = false;
    double time_ = 0.0;

    R angle_, theta_ = R(0.0), theta_middle_;
    R held_ = R(0.0), lagging_;
    R filtered_, filter_input_;
    R limited_command_;
    R friction_torque_ = R(0.0), per_beta_;
    R w_before_, other_friction_ = R(0.0);
    R own_w_before_, own_level_ = R(0.0);
    Bristle<R> bristle_;
    std::size_t issued_ = 0;
};

// Runs the lanes whose constants are given, with the plant's order known to the compiler where it is a usual one.
template <class R>
void run_effects(const EffectRun& run, const EffectConstants<R>& c) {
    if (run.two_masses) return EffectLoop<R, TwoMassPlant<R>>(run, c)();
    switch (run.order) {
        case 1: return EffectLoop<R, ObserverPlant<R, 1>>(run, c)();
        case 2: return EffectLoop<R, ObserverPlant<R, 2>>(run, c)();
        case 3: return EffectLoop<R, ObserverPlant<R, 3>>(run, c)();
        case 5: return EffectLoop<R, ObserverPlant<R, 5>>(run, c)();
        default: return EffectLoop<R, ObserverPlant<R, -1>>(run, c)();
    }
}

}  // namespace gaident
