// The digital controller of the simulated drive, at its own clock T, written from the definition in docs/controllers.md.
//
//   position    r = kv (q* - q) + kff v*       at every position_every-th sample, held between;  without kv: r is the command
//   filters     r -> command filters -> rate limit -> r',   measured velocity -> velocity filters -> w,   e = r' - w
//   integral    I(n) = I(n-1) + ki T (newest e(n) + (1 - newest) e(n-1)),   |I| <= integrator_limit,   e(-1) = 0
//   torque      v = kp (weight r' - w) + I + aff a* + fff sign(v*) + table,   |u| <= torque_limit,   u -> torque filters
//   table       f(v*) + viscous v* + constant + inertia a* + g(theta), both looked up in rows of numbers
//
// v*: slope of the position command over the coming position period, or the velocity command; a*: slope of v*.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

namespace rig_controller {

constexpr double inf = std::numeric_limits<double>::infinity();

struct Settings {  // neutral values: a bare PI
    // fields
    double kp = 0;  // N m s/rad
    double ki = 0;  // N m/rad
    double torque_limit = inf;
    double newest = 0.5;        // share of e(n) in a step of the integral; the rest is of e(n-1)
    double weight = 1;          // of the command in the proportional part
    double hold = 0;            // not 0: I keeps its last value where the limited torque would be driven further
    double tracking_time = 0;   // s; 0: no tracking
    double position_gain = 0;   // 1/s; 0: no position controller
    double position_every = 1;  // controller samples to one of the position controller
    double kff = 0;             // velocity feedforward
    double aff = 0;             // N m s2/rad
    double fff = 0;             // N m
    // end of fields
};

// Torque that is added beforehand, from numbers alone: viscous, constant, inertia, turn, m, k, then m velocities (ascending, and
// through 0), m torques there, and k torques evenly over a turn.
class Table {
public:
    explicit Table(const double* numbers) : given(numbers) {}

    double by_motion(double v, double a) const {
        if (!given) return 0;
        const int m = static_cast<int>(given[4]);
        const double *at = given + 6, *level = at + m;
        double f = v <= at[0] ? level[0] : level[m - 1];
        for (int i = 1; i < m; ++i)
            if (at[i - 1] < v && v <= at[i]) f = level[i - 1] + (v - at[i - 1]) / (at[i] - at[i - 1]) * (level[i] - level[i - 1]);
        return f + given[0] * v + given[1] + given[2] * a;
    }

    double by_angle(double angle) const {
        const int k = given ? static_cast<int>(given[5]) : 0;
        if (k == 0) return 0;
        const double* level = given + 6 + 2 * static_cast<int>(given[4]);
        const double place = (angle / given[3] - std::floor(angle / given[3])) * k;
        const int i = static_cast<int>(place) % k;
        return level[i] + (place - std::floor(place)) * (level[(i + 1) % k] - level[i]);
    }

private:
    const double* given;
};

// y(n) = b0 x(n) + b1 x(n-1) + b2 x(n-2) - a1 y(n-1) - a2 y(n-2)
class Filter {
public:
    // 1/(tau s + 1) behind a held input
    static Filter low_pass(double tau, double period) {
        const double kept = std::exp(-period / tau);
        return {1 - kept, 0, 0, -kept, 0};
    }

    // (s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2) with s = (w / tan(w T/2)) (z - 1)/(z + 1)
    static Filter notch(double hertz, double zn, double zd, double period) {
        const double w = 2 * std::acos(-1.0) * hertz, c = 1 / std::tan(w * period / 2);
        const double a0 = c * c + 2 * zd * c + 1;
        return {(c * c + 2 * zn * c + 1) / a0, 2 * (1 - c * c) / a0, (c * c - 2 * zn * c + 1) / a0, 2 * (1 - c * c) / a0,
                (c * c - 2 * zd * c + 1) / a0};
    }

    double operator()(double x) {
        const double y = b0 * x + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2;
        x2 = x1, x1 = x, y2 = y1, y1 = y;
        return y;
    }

    // The fields are in this order for the two functions above.
    double b0, b1, b2, a1, a2;
    double x1 = 0, x2 = 0, y1 = 0, y2 = 0;
};

inline double clamp(double value, double limit) { return value > limit ? limit : value < -limit ? -limit : value; }

class Controller {
public:
    // `filters`: `count` rows (place, kind, three numbers). place 0 command, 1 velocity, 2 torque; kind 0 low pass (tau),
    // 1 notch (Hz, zn, zd). `command`: n values at the controller's clock.
    Controller(const Settings& settings, const double* filters, int count, const double* command, int n, double period,
               double integrator_limit, double command_rate, const double* table)
        : c(settings),
          source(command),
          n(n),
          T(period),
          integrator_limit(integrator_limit),
          command_rate(command_rate),
          table(table) {
        for (int i = 0; i < count; ++i) {
            const double* row = filters + 5 * i;
            chains[static_cast<int>(row[0])].push_back(row[1] == 0 ? Filter::low_pass(row[2], T)
                                                                   : Filter::notch(row[2], row[3], row[4], T));
        }
    }

    // The torque command at sample i.
    double step(int i, double measured, double angle) {
        asked(i, angle);
        reference += clamp(through(0, held) - reference, command_rate * T);
        const double w = through(1, measured), error = reference - w;
        const double before = integral;
        integral = clamp(integral + c.ki * T * (c.newest * error + (1 - c.newest) * last_error), integrator_limit);
        last_error = error;
        const double rest = c.kp * (c.weight * reference - w) + added + table.by_angle(angle);
        double wanted = rest + integral;
        double u = clamp(wanted, c.torque_limit);
        if (c.hold != 0 && (wanted > u ? error > 0 : wanted < u && error < 0)) {
            integral = before;
            wanted = rest + integral;
            u = clamp(wanted, c.torque_limit);
        }
        if (c.tracking_time > 0) integral += (u - wanted) * T / c.tracking_time;
        return through(2, u);
    }

private:
    const Settings& c;
    const double* source;
    int n;
    double T, integrator_limit, command_rate;
    Table table;
    std::vector<Filter> chains[3];
    double integral = 0, last_error = 0, reference = 0;
    double held = 0, added = 0;  // velocity command and feedforward torque until they are made again

    double through(int place, double x) {
        for (Filter& f : chains[place]) x = f(x);
        return x;
    }

    // The command at sample i; behind its end it goes on as it came.
    double at(int i) const {
        if (i < n) return source[i];
        return n < 2 ? source[n - 1] : source[n - 1] + (i - n + 1) * (source[n - 1] - source[n - 2]);
    }

    void asked(int i, double angle) {
        const bool placed = c.position_gain > 0;
        const int m = placed ? static_cast<int>(c.position_every) : 1;
        if (i % m != 0) return;
        const double span = m * T;
        double v = at(i), a = (at(i + 1) - at(i)) / T;
        held = v;
        if (placed) {
            v = (at(i + m) - at(i)) / span;
            a = ((at(i + 2 * m) - at(i + m)) / span - v) / span;
            held = c.position_gain * (source[i] - angle) + c.kff * v;
        }
        added = c.aff * a + c.fff * static_cast<double>((v > 0) - (v < 0)) + table.by_motion(v, a);
    }
};

}  // namespace rig_controller
