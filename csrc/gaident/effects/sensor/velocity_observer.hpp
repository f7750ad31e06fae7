// The velocity of a tracking loop on the angle, of second order and critically damped, omega its bandwidth:
//
//     dq/dt = y + 2 omega (theta - q),   dy/dt = omega^2 (theta - q),   y/w = 1/(1 + s/omega)^2
//
// exact for a velocity w that is a parabola over the substep, 6 bend s (1 - s) beside the straight line between its ends:
// with a = omega h, d = (w+ - w)/a, g = y - w + 2 d, v = (dy/dt)/omega,
//
//     y+ = w+ - 2 d + e^-a ((1 + a) g + a (v - d)),   v+ = d + e^-a ((1 - a) (v - d) - a g)
//
// and to that 6 a^2 (I2 - I3) bend and 6 a (I1 - I2 - a (I2 - I3)) bend,  I_k = int u^k e^-(a u) du, u from 0 to 1
//
// and its mean over the substep is that of w less (2 (y+ - y) + v+ - v)/a, whatever w does.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct VelocityObserver {
    static constexpr EffectParameter parameters[] = {{"bandwidth", "rad/s", infinite, 0.0, infinite, true}};
    static constexpr EffectInfo info{
        .name = "velocity_observer",
        .place = Place::sensor,
        .meaning = "the velocity is that of a tracking loop on the {angle}, second order",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::sensor_dynamics | Hooks::begin;

    // y+ = w+ + of_y (y - w) + of_v v + of_step (w+ - w), and v+ likewise
    template <class R>
    struct Coefficients {
        R of_y, of_v, of_step, of_bend, slope_of_y, slope_of_v, slope_of_step, slope_of_bend;
        R lag;  // 1/a
    };
    template <class R>
    struct State {
        R output, slope, w;  // rad/s
    };
    static constexpr bool apart = true;
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor& made, Coefficients<double>& c) {
        const double a = p[0] * made.step, power = exp_of_minus(a), times = power > 0.0 ? a * power : 0.0;
        const double mean = Decay(a).mean;
        double bend, slope;
        answer_to_bend(a, power, bend, slope);
        c = {power + times, times, power - 2.0 * mean, bend, -times, power - times, mean - power, slope, 1.0 / a};
    }
    static void answer_to_bend(double a, double power, double& bend, double& slope) {
        if (a > 500.0) {  // beside e^-a nothing; a may be infinite
            bend = (12.0 - 36.0 / a) / a;
            slope = (24.0 / a - 6.0) / a;
            return;
        }
        double I[4];
        for (int k = 0; k < 4; ++k) {
            double sum = 0.0;
            if (a < 1.0)
                for (int j = 18; j >= 0; --j) sum = 1.0 / (k + j + 1) - a / (j + 1) * sum;
            I[k] = a < 1.0 ? sum : ((k > 0 ? k * I[k > 0 ? k - 1 : 0] : 1.0) - power) / a;
        }
        bend = 6.0 * a * a * (I[2] - I[3]);
        slope = 6.0 * a * (I[1] - I[2]) - bend;
    }
    template <class R>
    static void begin(const Coefficients<R>&, State<R>& s, const Beginning<R>& start) {
        s.output = s.w = start.velocity;
    }

    template <class R>
    [[gnu::noinline]] static R sensor_dynamics(const Coefficients<R>& c, State<R>& s, R w_next, R bend) {
        const R step = w_next - s.w, behind = s.output - s.w, slope = s.slope;
        s.output = w_next + fma(c.of_bend, bend, fma(c.of_step, step, fma(c.of_v, slope, c.of_y * behind)));
        s.slope = fma(c.slope_of_bend, bend, fma(c.slope_of_step, step, fma(c.slope_of_v, slope, c.slope_of_y * behind)));
        s.w = w_next;
        return s.output;
    }
    template <class R>
    [[gnu::always_inline]] static R bend_behind(const Coefficients<R>& c, const State<R>& before, const State<R>& s, R bend) {
        const R ends = (before.w - before.output) + (s.w - s.output);
        const R moved = fma(s.output - before.output, R(2.0), s.slope - before.slope);
        return fnma(moved, c.lag, fma(ends, R(0.5), bend));
    }
};

}  // namespace gaident
