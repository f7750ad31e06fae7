// The measured velocity's filter 1/(1 + s tau), exact for a velocity that is a parabola over the substep, 6 bend s (1 - s) beside the
// straight line between its ends, s from 0 to 1, x = h/tau:
//
//     y+ = e^-x y + (1 - e^-x - c) w + c w+ + b bend,   c = 1 - (1 - e^-x)/x,   b = -12 int (s - 1/2) e^-(s x) ds
//
// and its mean over the substep is that of w less (y+ - y)/x, whatever w does.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct VelocityFilter {
    static constexpr EffectParameter parameters[] = {{"time_constant", "s", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "velocity_filter",
        .place = Place::sensor,
        .meaning = "the measured velocity is filtered, first order",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::sensor_dynamics | Hooks::begin;

    template <class R>
    struct Coefficients {
        R decay, of_old, of_new, of_bend, lag;  // e^-x, 1 - e^-x - c, c, b, 1/x
    };
    template <class R>
    struct State {
        R output, w;  // rad/s
    };
    static constexpr bool apart = true;
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor& time, Coefficients<double>& c) {
        const Decay decay(time.step / p[0]);
        c = {decay.power, decay.mean - decay.power, 1.0 - decay.mean, -decay.rise, p[0] / time.step};
    }
    template <class R>
    static void begin(const Coefficients<R>&, State<R>& s, const Beginning<R>& start) {
        s.output = s.w = start.velocity;
    }

    template <class R>
    [[gnu::always_inline]] static R sensor_dynamics(const Coefficients<R>& c, State<R>& s, R w_next, R bend) {
        s.output = fma(c.of_bend, bend, fma(c.of_new, w_next, fma(c.of_old, s.w, c.decay * s.output)));
        s.w = w_next;
        return s.output;
    }
    template <class R>
    [[gnu::always_inline]] static R bend_behind(const Coefficients<R>& c, const State<R>& before, const State<R>& s, R bend) {
        const R ends = (before.w - before.output) + (s.w - s.output);
        return fnma(s.output - before.output, c.lag, fma(ends, R(0.5), bend));
    }
};

}  // namespace gaident
