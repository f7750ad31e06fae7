// The current loop's lag 1/(1 + s tau), exact for a torque that goes from v - d/2 to v + d/2 over the substep h, x = h/tau, s from 0 to 1:
//
//     T(s) = v + (T - v) e^-(s x) + d ((s - 1/2) - 1/x + (1/x + 1/2) e^-(s x)),   T+ = T(1)
#pragma once

#include "../effect.hpp"

namespace gaident {

struct TorqueLag {
    static constexpr EffectParameter parameters[] = {{"time_constant", "s", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "torque_lag",
        .place = Place::actuator,
        .meaning = "the {torque} follows its command with a first-order lag",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::actuator_dynamics | Hooks::begin;

    template <class R>
    struct Coefficients {
        R decay, mean, rise;                          // e^-x; mean and rise of e^-(s x)
        R decay_of_rise, mean_of_rise, rise_of_rise;  // the same of what follows d
    };
    template <class R>
    struct State {
        R T;  // N m
    };
    static constexpr bool apart = true;
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor& time, Coefficients<double>& c) {
        const Decay decay(time.step / p[0]);
        c.decay = decay.power;
        c.mean = decay.mean;
        c.rise = decay.rise;
        c.decay_of_rise = 0.5 * (1.0 + decay.power) - decay.mean;
        c.mean_of_rise = decay.rise / 12.0;
        c.rise_of_rise = 1.0 + (p[0] / time.step + 0.5) * decay.rise;
    }
    template <class R>
    static void begin(const Coefficients<R>&, State<R>& s, const Beginning<R>& start) {
        s.T = start.torque;
    }

    template <class R, class Past>
    [[gnu::always_inline]] static Course<R> actuator_dynamics(const Coefficients<R>& c, State<R>& s, const Past&, Course<R> v) {
        const R gap = s.T - v.mean;
        s.T = fma(v.rise, c.decay_of_rise, fma(gap, c.decay, v.mean));
        return {fma(v.rise, c.mean_of_rise, fma(gap, c.mean, v.mean)), fma(v.rise, c.rise_of_rise, gap * c.rise)};
    }
};

}  // namespace gaident
