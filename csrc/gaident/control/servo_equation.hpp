// The linear loop of a servo axis (servo.hpp) as ONE difference equation from line to line of its log, which has a line for every
// r-th sample of the controller.
//
// At the controller's clock T, with the plant B/A behind its hold, filters F (torque), V (velocity) and C (command), and
//
//     u = F (P_r C r' - P_w V w + a_ff delta r'/T),   P_w = (c1 delta + c0)/delta,   P_r = (c1' delta + c0)/delta
//     c0 = ki T,   c1 = kp + newest ki T,   c1' = weight kp + newest ki T
//
// the loop from velocity command r' to velocity w is N/D with
//
//     D = (delta A F_d V_d z^m + (c1 delta + c0) B F_n V_n) C_d             a torque acts m samples later
//     N = ((c1' delta + c0) C_n + a_ff/T delta^2 C_d) B F_n V_d
//
// A position controller works every k-th sample: N/D and that of the angle, N T/2 (delta + 2)/(delta D), are decimated by k with
// r' held (plant/decimation.hpp), and closed by r' = kv (q* - q) + k_ff v*, v* the slope of q* over the coming k samples.
// What is left of r is a decimation of that loop.
#pragma once

#include "../plant/decimation.hpp"
#include "controller.hpp"

#include <algorithm>

namespace gaident {

// What is added of the command's slope, and of the slope's: k_ff, of a position command; a_ff [N m s^2/rad], of a velocity command.
struct Feedforward {
    double velocity = 0.0, acceleration = 0.0;
};

class ServoEquation {
public:
    // Throws std::invalid_argument where the loop is no linear equation.
    ServoEquation(const Loop& loop, const Clock& clock, const Feedforward& feedforward, Between between)
        : period_(clock.period),
          between_(between),
          position_gain_(loop.servo.position_gain),
          slope_(feedforward.velocity),
          immediate_(feedforward.velocity != 0.0 || feedforward.acceleration != 0.0),
          inner_(position_gain_ != 0.0 ? loop.servo.position_every : 1),
          outer_(lines(loop, clock)) {
        const Controller& c = loop.controller;
        const ServoSettings& s = loop.servo;
        const double T = period_, c0 = c.ki * T, integral = c.ki * T * s.newest;
        if (c.limited()) throw std::invalid_argument("controller: one with a limit is no linear equation");
        if (s.differenced) throw std::invalid_argument("differenced: no one equation of so many poles");
        const double delay = s.delay / T, whole = std::round(delay);
        if (std::abs(delay - whole) > 1e-9) throw std::invalid_argument("delay must be a whole number of periods");
        if (whole > max_loop_order) throw std::invalid_argument("delay: no one equation of so many poles");

        Polynomial torque_n{1.0}, torque_d{1.0}, velocity_n{1.0}, velocity_d{1.0}, command_n{1.0};
        command_ = {1.0};
        chain(s.torque_filters, torque_n, torque_d);
        chain(s.velocity_filters, velocity_n, velocity_d);
        chain(s.command_filters, command_n, command_);
        back_ = times(times({c0, c.kp + integral}, torque_n), velocity_n);
        Polynomial forward = times({c0, c.kp * s.command_weight + integral}, command_n);
        if (feedforward.acceleration != 0.0) {
            const Polynomial fed = times({0.0, 0.0, feedforward.acceleration / T}, command_);
            forward.resize(std::max(forward.size(), fed.size()));
            for (std::size_t i = 0; i < fed.size(); ++i) forward[i] += fed[i];
        }
        forward_ = times(times(forward, torque_n), velocity_d);
        own_ = times(times({0.0, 1.0}, torque_d), velocity_d);
        for (int i = 0; i < static_cast<int>(whole); ++i) own_ = times(own_, {1.0, 1.0});
        if (position_gain_ != 0.0) {
            if (feedforward.acceleration != 0.0)
                throw std::invalid_argument("acceleration_feedforward: not in one equation with a position controller");
            position_period_ = T * s.position_every;
        }
    }

    double period() const { return period_; }
    Between between() const { return between_; }
    // Whether a constant velocity command leaves y = r, so that a[N-1] is b[N].
    bool rests_at_its_command() const { return position_gain_ == 0.0 && between_ == Between::held && !immediate_; }
    // Of the equation, for a plant with so many poles.
    int order(int poles) const {
        return poles + static_cast<int>(own_.size() + command_.size()) - 2 + (position_gain_ != 0.0 ? 1 : 0);
    }

    // The loop over a plant behind its hold at period(): a, b for the command at the lines of the log; where it is mixed,
    // `straight` [order + 1] is what its straight part adds to b.
    template <class R, int N>
    Delta<R> operator()(const Delta<R, N>& plant, R* straight) const {
        const int poles = N >= 0 ? N : plant.order, n = order(poles);
        const R zero(0.0);
        Powers<R> D, numerator[2];
        Powers<R>& w = numerator[0];
        const int first = position_gain_ != 0.0 ? 1 : 0;  // the angle's own power of delta
        for (int i = 0; i <= n; ++i) D.c[i] = w.c[i] = numerator[1].c[i] = zero;
        Powers<R> sum;
        for (int i = 0; i <= n; ++i) sum.c[i] = zero;
        for (int i = 0; i <= poles; ++i) {
            const R a = i == poles ? R(1.0) : plant.a[poles - 1 - i], b = plant.b[poles - i];
            add(own_, a, i, sum);
            add(back_, b, i, sum);
            add(forward_, b, i + first, w);
        }
        for (int i = 0; i + first <= n; ++i) add(command_, sum.c[i], i + first, D, n);
        if (first > 0) {
            close_position(n, D, w, numerator[1]);
        }
        const Between both[2] = {between_ == Between::straight ? Between::straight : Between::held, Between::straight};
        const int numerators = between_ == Between::mixed ? 2 : 1;
        if (numerators == 2) numerator[1] = w;
        outer_(n, D, numerator, both, numerators);

        Delta<R> loop;
        loop.order = n;
        for (int i = 0; i < n; ++i) loop.a[i] = D.c[n - 1 - i];
        for (int i = 0; i <= n; ++i) loop.b[i] = w.c[n - i];
        if (both[0] == Between::held && !immediate_) loop.b[0] = zero;
        if (numerators == 2)
            for (int i = 0; i <= n; ++i) straight[i] = numerator[1].c[n - i] - loop.b[i];
        return loop;
    }

private:
    using Polynomial = std::vector<double>;  // ascending powers of delta

    static int lines(const Loop& loop, const Clock& clock) {
        if (loop.servo.position_gain == 0.0) return clock.log_every;
        if (clock.log_every % loop.servo.position_every != 0)
            throw std::invalid_argument("position_every: the log has a line between two samples of the position controller");
        return clock.log_every / loop.servo.position_every;
    }

    static Polynomial times(const Polynomial& x, const Polynomial& y) {
        Polynomial out(x.size() + y.size() - 1, 0.0);
        for (std::size_t i = 0; i < x.size(); ++i)
            for (std::size_t j = 0; j < y.size(); ++j) out[i + j] += x[i] * y[j];
        return out;
    }

    // b0 + b1 z^-1 + b2 z^-2 over 1 + a1 z^-1 + a2 z^-2, in delta.
    static void chain(const FilterChain& filters, Polynomial& numerator, Polynomial& denominator) {
        for (int i = 0; i < filters.count; ++i) {
            const DigitalFilter& f = filters.filter[i];
            if (f.b2 == 0.0 && f.a2 == 0.0) {
                numerator = times(numerator, {f.b0 + f.b1, f.b0});
                denominator = times(denominator, {1.0 + f.a1, 1.0});
            } else {
                numerator = times(numerator, {(f.b0 + f.b1) + f.b2, 2.0 * f.b0 + f.b1, f.b0});
                denominator = times(denominator, {(1.0 + f.a1) + f.a2, 2.0 + f.a1, 1.0});
            }
        }
    }

    // out += x times factor delta^power, up to delta^n where that is known
    template <class R>
    static void add(const Polynomial& x, R factor, int power, Powers<R>& out, int n = max_loop_order) {
        for (std::size_t i = 0; i < x.size() && power + static_cast<int>(i) <= n; ++i) {
            R& c = out.c[power + static_cast<int>(i)];
            c = fma(R(x[i]), factor, c);
        }
    }

    template <class R>
    void close_position(int n, Powers<R>& D, Powers<R>& w, Powers<R>& angle) const {
        const R half(0.5 * period_);
        // w has a factor delta that the angle lacks
        Powers<R>* const pair = &w;
        for (int i = 0; i < n; ++i) {
            const R lower = w.c[i + 1];
            angle.c[i] = fma(lower + lower, half, angle.c[i]);
            angle.c[i + 1] = lower * half;
        }
        const Between held[2] = {Between::held, Between::held};
        inner_(n, D, pair, held, 2);
        const R gain(position_gain_), slope(slope_ / position_period_);
        for (int i = n; i >= 0; --i) {
            D.c[i] = fma(gain, angle.c[i], D.c[i]);
            w.c[i] = fma(gain, w.c[i], i > 0 ? R(slope * w.c[i - 1]) : R(0.0));
        }
    }

    double period_, position_period_ = 0.0;
    Between between_;
    double position_gain_, slope_;
    bool immediate_;  // the velocity answers a jump of the command at once, by its slope
    Decimation inner_, outer_;
    Polynomial own_, back_, forward_, command_;
};

}  // namespace gaident
