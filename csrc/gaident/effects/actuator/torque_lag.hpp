// The current loop's lag 1/(1 + s tau), exact for a torque v held over the substep h, x = h/tau:
//
//     T+ = v + (T - v) e^-x,   mean of T over the substep = v + (T - v) (1 - e^-x)/x
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
        R decay, mean;  // e^-x, (1 - e^-x)/x
    };
    template <class R>
    struct State {
        R T;  // N m
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor& time, Coefficients<double>& c) {
        const Decay decay(time.step / p[0]);
        c.decay = decay.power;
        c.mean = decay.mean;
    }
    template <class R>
    static void begin(const Coefficients<R>&, State<R>& s, const Beginning<R>& start) {
        s.T = start.torque;
    }

    template <class R, class Past>
    [[gnu::always_inline]] static R actuator_dynamics(const Coefficients<R>& c, State<R>& s, const Past&, R v) {
        const R gap = s.T - v;
        s.T = fma(gap, c.decay, v);
        return fma(gap, c.mean, v);
    }
};

}  // namespace gaident
