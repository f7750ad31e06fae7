// A drive in continuous time, for blind tests: written from the definitions of the effects alone, sharing nothing with the
// library.
//
//   motor   J1 dw/dt = M - D1 w - Tc        M  = g (s^2 + 2 zz wz s + wz^2)/(s^2 + 2 zp wp s + wp^2) {T + q - f},  g = (wp/wz)^2
//   load    J2 dw2/dt = Tc - D2 w2 + q2 - f2    Tc = K x + DG dx/dt + k3 x^3 beyond the gap, 0 inside; x = theta - theta2
//
// T: torque behind saturation, dead band, delay and lag; q: smooth shaft torques; f: dry friction; q2, f2: the same at the load,
// with its velocity and angle. Effects at the load and a further resonance do not go together.
// Every sample is cut at the instant where the delayed torque changes and into substeps of a Runge-Kutta step of fourth order.
// Dry friction has three regimes at each end (sliding +, sliding -, at rest); the instant of the first zero crossing is found by a
// secant iteration, and at rest w is exactly 0 until the torque that holds that end exceeds its friction's level.
// The controller is digital, as a drive has it: drive_rig_controller.hpp.
//
// Compiled and called by tests/python/support/drive_rig.py, which reads the list of fields below.
#include "drive_rig_controller.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

struct Drive {  // SI units, rad; neutral values
    // fields
    double J1 = 1e-3;  // kg m2
    double D1 = 0;     // N m s/rad
    double J2 = 0;     // 0: one mass
    double D2 = 0;
    double K = 0;  // N m/rad
    double DG = 0;
    double integrator_limit = inf;  // known setting or hidden effect
    double command_rate = inf;      // rad/s2
    double saturation = inf;
    double dead_band = 0;
    double delay = 0;   // s
    double lag = 0;     // s
    double filter = 0;  // s
    double ripple = 0;
    double ripple_order = 1;
    double ripple_phase = 0;
    double ripple_2 = 0;  // further waves of it
    double ripple_order_2 = 1;
    double ripple_phase_2 = 0;
    double ripple_3 = 0;
    double ripple_order_3 = 1;
    double ripple_phase_3 = 0;
    double ripple_4 = 0;
    double ripple_order_4 = 1;
    double ripple_phase_4 = 0;
    double quantum = 0;            // rad/s
    double differenced = 0;        // not 0: the encoder's own angle is differenced, half a sample late
    double encoder = 0;            // rad
    double friction_positive = 0;  // dry friction for w > 0 and w < 0, N m
    double friction_negative = 0;
    double viscous_positive = 0;  // N m s/rad
    double viscous_negative = 0;
    double stribeck = 0;  // Ts - Tc, N m
    double stribeck_velocity = 1;
    double drifting = 0;  // friction Tc (1 + rate t), N m
    double drift_rate = 0;
    double dahl = 0;  // N m
    double dahl_stiffness = 1;
    double lugre = 0;  // Tc, N m
    double lugre_static = 0;
    double lugre_velocity = 1;
    double lugre_stiffness = 1;
    double lugre_damping = 0;
    double drag = 0;  // N m s2/rad2
    double load = 0;  // N m
    double unbalance = 0;
    double unbalance_phase = 0;
    double ground = 0;  // a spring to the ground, N m/rad, that rests at the angle `rest` [rad]
    double rest = 0;
    double cogging = 0;
    double cogging_order = 2;
    double cogging_phase = 0;
    double cogging_2 = 0;  // further waves of it
    double cogging_order_2 = 2;
    double cogging_phase_2 = 0;
    double cogging_3 = 0;
    double cogging_order_3 = 2;
    double cogging_phase_3 = 0;
    double cogging_4 = 0;
    double cogging_order_4 = 2;
    double cogging_phase_4 = 0;
    double gap = 0;    // rad
    double cubic = 0;  // N m/rad3
    double wp = 0;     // rad/s; 0: no extra resonance
    double zp = 0;
    double wz = 1;
    double zz = 0;
    double uneven = 0;  // dry friction uneven (1 + uneven_share cos(uneven_order theta + uneven_phase)), N m
    double uneven_share = 0;
    double uneven_order = 1;
    double uneven_phase = 0;
    double root = 0;        // drag root sqrt|w| sign(w)
    double hysteretic = 0;  // a Dahl spring beside the shaft, N m/rad, and what it yields at, N m
    double hysteretic_torque = 1;
    double hum = 0;            // torque in time [N m],
    double hum_frequency = 0;  // Hz
    double hum_phase = 0;
    double turning = 0;  // share by which the load's inertia, with one mass all of it, changes with its angle
    double turning_order = 1;
    double turning_phase = 0;
    double loaded = 0;       // dry friction as a share of the torque that gravity and the load put on the axis
    double walking = 0;      // dry friction walking (1 + W), W a random walk of walk_size in a second, never below 0,
    double walk_size = 0;    // 1/s^0.5
    double walk_number = 0;  // which walk
    double gain_lost = 0;    // share of the torque that is lost once the motor is warm,
    double warming = 1;      // s
    double resolver = 0;     // error of the angle sensor that grows with speed, rad s/rad,
    double resolver_order = 1;
    double resolver_phase = 0;
    double stop = 0;        // a hard stop of the motor's angle, N m/rad,
    double stop_angle = 0;  // reached from 0
    double stop_damping = 0;
    double growing = 0;  // the load's inertia, with one mass all of it, is J (1 + growing t), 1/s
    // end of fields
};

enum Index { w1, angle, w2, twist, lagged, bristle, bent, bristle2, bent2, filtered, e1, e2, hysteresis, states };
using State = std::array<double, states>;

double sign(double value) { return static_cast<double>((value > 0) - (value < 0)); }

// A random walk at knots of 10 ms, for 40 s, from a generator of its own: sums of twelve even numbers are nearly normal.
constexpr double knot = 0.01;
std::vector<double> walked(const Drive& d) {
    std::uint64_t number = 0x9E3779B97F4A7C15u + static_cast<std::uint64_t>(d.walk_number);
    std::vector<double> found(4001);
    for (std::size_t i = 1; i < found.size(); ++i) {
        double normal = -6;
        for (int k = 0; k < 12; ++k) {
            number = number * 6364136223846793005u + 1442695040888963407u;
            normal += static_cast<double>(number >> 11) * 0x1p-53;
        }
        found[i] = found[i - 1] + d.walk_size * std::sqrt(knot) * normal;
    }
    return found;
}
double walked_to(const std::vector<double>& walk, double t) {
    const double last = static_cast<double>(walk.size() - 2), at = std::min(std::max(t / knot, 0.0), last);
    const auto i = static_cast<std::size_t>(at);
    return walk[i] + (at - static_cast<double>(i)) * (walk[i + 1] - walk[i]);
}

// The effects of the shaft at one end of it: their sizes, and the states that they have.
struct End {
    const Drive& d;
    const Index speed, bristle, bent;
    const bool load;
    const bool dry = d.friction_positive != 0 || d.friction_negative != 0 || d.viscous_positive != 0 || d.viscous_negative != 0 ||
                     d.stribeck != 0 || d.drifting != 0 || d.uneven != 0 || d.loaded != 0 || d.walking != 0;
    const std::vector<double> walk = d.walking != 0 ? walked(d) : std::vector<double>{};

    double turned(const State& x) const { return load ? x[angle] - x[twist] : x[angle]; }

    // Magnitude of dry friction when this end turns, or is about to turn, in the direction `way`.
    double level(const State& x, double t, int way) const {
        const double fast = std::abs(x[speed]);
        double f = way > 0 ? d.friction_positive + d.viscous_positive * fast : d.friction_negative + d.viscous_negative * fast;
        if (d.stribeck != 0) f += d.stribeck * std::exp(-(fast / d.stribeck_velocity) * (fast / d.stribeck_velocity));
        if (d.drifting != 0) f += d.drifting * (1 + d.drift_rate * t);
        if (d.uneven != 0) f += d.uneven * (1 + d.uneven_share * std::cos(d.uneven_order * turned(x) + d.uneven_phase));
        if (d.walking != 0) f += d.walking * std::max(1 + walked_to(walk, t), 0.0);
        if (d.loaded != 0) f += d.loaded * std::abs(d.load + d.unbalance * std::sin(turned(x) + d.unbalance_phase));
        return f;
    }

    // dz/dt of the LuGre bristle
    double bending(const State& x) const {
        const double ratio = x[speed] / d.lugre_velocity;
        const double g = d.lugre + (d.lugre_static - d.lugre) * std::exp(-ratio * ratio);
        return x[speed] - d.lugre_stiffness * std::abs(x[speed]) * x[bent] / g;
    }

    // The smooth torques here, added to what else acts.
    double smooth(const State& x, double t, double q) const {
        q -= d.load;
        if (d.drag != 0) q -= d.drag * x[speed] * std::abs(x[speed]);
        if (d.dahl != 0) q -= d.dahl_stiffness * x[bristle];
        if (d.lugre != 0) q -= d.lugre_stiffness * x[bent] + d.lugre_damping * bending(x);
        if (!load) q -= d.ground * (x[angle] - d.rest);
        if (!load && d.stop != 0) {  // it pushes, and never pulls
            const double out = sign(d.stop_angle), into = out * (x[angle] - d.stop_angle);
            if (into > 0) q -= out * std::max(d.stop * into + d.stop_damping * out * x[speed], 0.0);
        }
        if (d.unbalance != 0) q -= d.unbalance * std::sin(turned(x) + d.unbalance_phase);
        if (d.cogging != 0) q -= d.cogging * std::sin(d.cogging_order * turned(x) + d.cogging_phase);
        if (d.cogging_2 != 0) q -= d.cogging_2 * std::sin(d.cogging_order_2 * turned(x) + d.cogging_phase_2);
        if (d.cogging_3 != 0) q -= d.cogging_3 * std::sin(d.cogging_order_3 * turned(x) + d.cogging_phase_3);
        if (d.cogging_4 != 0) q -= d.cogging_4 * std::sin(d.cogging_order_4 * turned(x) + d.cogging_phase_4);
        if (d.hum != 0) q += d.hum * std::sin(6.283185307179586477 * d.hum_frequency * t + d.hum_phase);
        if (d.root != 0) q -= d.root * std::sqrt(std::abs(x[speed])) * sign(x[speed]);
        return q;
    }

    void bristles(const State& x, State& dx) const {
        if (d.dahl != 0) dx[bristle] = x[speed] - d.dahl_stiffness * std::abs(x[speed]) * x[bristle] / d.dahl;
        if (d.lugre != 0) dx[bent] = bending(x);
    }
};

using Ways = std::array<int, 2>;  // of motor and load: -1, 0 (at rest), 1

class Rig {
public:
    // load: whose shaft effects act at the load; nothing else of it is read
    Rig(const Drive& drive, const Drive& load)
        : d(drive),
          ends{End{drive, w1, ::bristle, ::bent, false}, End{load, w2, bristle2, bent2, true}},
          extra(d.wp > 0),
          g(extra ? (d.wp / d.wz) * (d.wp / d.wz) : 1) {}

    State s{};
    double held = 0;       // torque at the input of the lag
    double disturbed = 0;  // disturbance torque on the shaft

    double rippled() const { return rippled(s); }

    // Integrate from time t over `span` seconds in `count` steps.
    void advance(double t, double span, int count) {
        const double h = span / count;
        for (int i = 0; i < count; ++i) {
            if (ends[0].dry || ends[1].dry) {
                substep_with_friction(t + i * h, h);
            } else {
                s = runge_kutta(s, t + i * h, h, {});
            }
        }
    }

private:
    const Drive& d;
    const std::array<End, 2> ends;
    const bool extra;
    const double g;
    Ways regime{};

    double rippled(const State& x) const {
        if (d.ripple == 0 && d.resolver == 0) return x[w1];
        const double error = d.resolver * std::abs(x[w1]) * d.resolver_order;
        double further = 0;
        if (d.ripple_2 != 0) further += d.ripple_2 * d.ripple_order_2 * std::cos(d.ripple_order_2 * x[angle] + d.ripple_phase_2);
        if (d.ripple_3 != 0) further += d.ripple_3 * d.ripple_order_3 * std::cos(d.ripple_order_3 * x[angle] + d.ripple_phase_3);
        if (d.ripple_4 != 0) further += d.ripple_4 * d.ripple_order_4 * std::cos(d.ripple_order_4 * x[angle] + d.ripple_phase_4);
        return x[w1] * (1 + further + d.ripple * d.ripple_order * std::cos(d.ripple_order * x[angle] + d.ripple_phase) +
                        error * std::cos(d.resolver_order * x[angle] + d.resolver_phase));
    }

    // Torque of the actuator and what disturbs it.
    double driving(const State& x, double t) const {
        const double T = d.lag > 0 ? x[lagged] : held;
        return disturbed + (d.gain_lost != 0 ? T * (1 - d.gain_lost * (1 - std::exp(-t / d.warming))) : T);
    }

    // What acts on one end without the coupling and without dry friction.
    double smooth(int end, const State& x, double t) const { return ends[end].smooth(x, t, end == 0 ? driving(x, t) : 0); }

    double coupling(const State& x) const {
        double open = x[twist];
        const double beside = d.hysteretic * x[hysteresis];
        if (d.gap > 0) {
            if (std::abs(open) < d.gap / 2) return beside;
            open -= d.gap / 2 * sign(open);
        }
        return d.K * open + d.DG * (x[w1] - x[w2]) + d.cubic * open * open * open + beside;
    }

    // What the resonance's own states add to the torque behind it.
    double stored(const State& x) const {
        return extra ? g * ((d.wz * d.wz - d.wp * d.wp) * x[e1] + 2 * (d.zz * d.wz - d.zp * d.wp) * x[e2]) : 0;
    }

    // The friction torque that keeps one end at rest.
    double holding(int end, const State& x, double t) const {
        if (end == 1) return smooth(1, x, t) + coupling(x);
        return smooth(0, x, t) + (stored(x) - (d.J2 > 0 ? coupling(x) : 0)) / g;
    }

    State slope(const State& x, double t, const Ways& way) const {
        State dx{};
        const double tc = d.J2 > 0 ? coupling(x) : 0;
        const bool resting = ends[0].dry && way[0] == 0;
        double net = smooth(0, x, t);
        if (resting) {
            net = (tc - stored(x)) / g;
        } else if (ends[0].dry) {
            net -= way[0] * ends[0].level(x, t, way[0]);
        }
        // J(theta) = J (1 + a cos(psi)), and the torque -J'(theta) w^2/2
        const double theta = d.J2 > 0 ? x[angle] - x[twist] : x[angle], psi = d.turning_order * theta + d.turning_phase;
        const double share = (1 + d.turning * std::cos(psi)) * (1 + d.growing * t),
                     bend = 0.5 * d.turning * d.turning_order * std::sin(psi);
        const double J1 = d.J2 > 0 ? d.J1 : d.J1 * share, J2 = d.J2 * share;
        const double outward = d.J2 > 0 ? 0 : d.J1 * (bend * x[w1] - d.growing) * x[w1];  // d(J w)/dt = J dw/dt + J' w
        dx[w1] = resting ? 0 : (g * net + stored(x) - d.D1 * x[w1] - tc + outward) / J1;
        dx[angle] = x[w1];
        if (d.J2 > 0) {
            const double own = smooth(1, x, t) - (ends[1].dry ? way[1] * ends[1].level(x, t, way[1]) : 0);
            dx[w2] = ends[1].dry && way[1] == 0 ? 0 : (tc - d.D2 * x[w2] + own + d.J2 * (bend * x[w2] - d.growing) * x[w2]) / J2;
            dx[twist] = x[w1] - x[w2];
            if (d.hysteretic != 0) {
                const double rate = dx[twist], yielded = d.hysteretic * x[hysteresis] / d.hysteretic_torque;
                dx[hysteresis] = rate - std::abs(rate) * yielded;
            }
        }
        if (d.lag > 0) dx[lagged] = (held - x[lagged]) / d.lag;
        for (const End& end : ends) end.bristles(x, dx);
        if (d.filter > 0) dx[filtered] = (rippled(x) - x[filtered]) / d.filter;
        if (extra) {
            dx[e1] = x[e2];
            dx[e2] = net - 2 * d.zp * d.wp * x[e2] - d.wp * d.wp * x[e1];
        }
        return dx;
    }

    State runge_kutta(const State& x, double t, double h, const Ways& way) const {
        const auto moved = [&](const State& k, double by) {
            State y = x;
            for (int i = 0; i < states; ++i) y[i] += by * k[i];
            return y;
        };
        const State k1 = slope(x, t, way), k2 = slope(moved(k1, h / 2), t + h / 2, way);
        const State k3 = slope(moved(k2, h / 2), t + h / 2, way), k4 = slope(moved(k3, h), t + h, way);
        State y = x;
        for (int i = 0; i < states; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
        return y;
    }

    // The regime of an end that follows from rest.
    int from_rest(int end, double t) const {
        const double needed = holding(end, s, t);
        return needed > ends[end].level(s, t, 1) ? 1 : needed < -ends[end].level(s, t, -1) ? -1 : 0;
    }

    // When an end that slides comes to rest within h from t, with the state there; h and the state at its end where it does not.
    std::pair<double, State> stop(int end, double t, double h, double substep, const State& whole) const {
        if (!ends[end].dry || regime[end] == 0 || regime[end] * whole[ends[end].speed] >= 0) return {h, whole};
        const Index shaft = ends[end].speed;
        // w(a) >= 0 >= w(b), seen in the direction of motion: regula falsi between the two, Illinois.
        double a = 0, b = h, wa = s[shaft], wb = whole[shaft];
        State crossing = s;
        for (int i = 0; i < 40 && b - a > 1e-9 * substep; ++i) {
            const double middle = wa == wb ? b : a + (b - a) * wa / (wa - wb);
            crossing = runge_kutta(s, t, middle, regime);
            if (std::abs(crossing[shaft]) < 1e-13) {
                a = b = middle;
            } else if (regime[end] * crossing[shaft] > 0) {
                a = middle, wa = crossing[shaft], wb /= 2;
            } else {
                b = middle, wb = crossing[shaft], wa /= 2;
            }
        }
        return {b, crossing};
    }

    void substep_with_friction(double t, double h) {
        const double until = t + h;
        int last = 0;
        for (int events = 0; events < 20 && until - t > 1e-6 * h; ++events) {
            const double left = until - t;
            for (int end = 0; end < 2; ++end)
                if (ends[end].dry && regime[end] == 0) regime[end] = from_rest(end, t);
            const State whole = runge_kutta(s, t, left, regime);
            const auto motor = stop(0, t, left, h, whole), load = stop(1, t, left, h, whole);
            const bool first = motor.first <= load.first;
            const auto& [passed, state] = first ? motor : load;
            last = first ? 0 : 1;
            s = state;
            const Index shaft = ends[last].speed;
            if (!(ends[last].dry && regime[last] != 0 && regime[last] * whole[shaft] < 0)) return;
            s[shaft] = 0;
            t += passed;
            regime[last] = from_rest(last, t);
        }
        if (until - t > 1e-6 * h) {  // too many events for one substep: that end is at rest
            regime[last] = 0;
            s = runge_kutta(s, t, until - t, regime);
        }
    }
};

using rig_controller::clamp;

}  // namespace

// One run of n samples of the controller. `command` drives the loop; where it is null, `given` is the torque command of an open
// loop. `measured`, where given, is what the controller reads instead of the velocity (a replay).
// table: what the controller adds beforehand, as drive_rig_controller.hpp has it, or null.
// Returns 0, or 1 where the drive ran away. load: whose effects of the shaft act at the load.
extern "C" int drive_rig_run(const Drive* drive, const Drive* load, const rig_controller::Settings* settings,
                             const double* filters, int filter_count, int n, double dt, int substeps, const double* command,
                             const double* given, const double* measured, const double* velocity_noise,
                             const double* torque_noise, const double* table, double* velocity, double* torque, double* position,
                             double* truth, double* load_velocity, double* load_position) {
    const Drive& d = *drive;
    Rig rig(d, *load);
    rig_controller::Controller controller(*settings, filters, filter_count, command, n, dt, d.integrator_limit, d.command_rate,
                                          table);
    std::vector<double> acted(static_cast<std::size_t>(n));
    const auto at = [&](int i) { return i < 0 ? 0.0 : acted[static_cast<std::size_t>(i)]; };
    const int whole = static_cast<int>(d.delay / dt + 1e-12);
    const double part = d.delay - whole * dt > 1e-9 * dt ? d.delay - whole * dt : 0;
    const int before = static_cast<int>(std::ceil(substeps * part / dt)),
              after = static_cast<int>(std::ceil(substeps * (1 - part / dt)));
    double encoded = 0, last_line = 0;
    for (int i = 0; i < n; ++i) {
        double w = d.filter > 0 ? rig.s[filtered] : rig.rippled();
        truth[i] = rig.s[w1];
        position[i] = rig.s[angle];
        load_velocity[i] = rig.s[w2];
        load_position[i] = rig.s[angle] - rig.s[twist];
        if (!(std::abs(truth[i]) < 1e5)) return 1;
        if (velocity_noise) w += velocity_noise[i];
        if (d.quantum > 0) w = std::round(w / d.quantum) * d.quantum;
        if (d.encoder > 0) {
            // Differences of a position lattice.
            // The sum of the samples follows w without the half sample that the difference of the angle itself costs.
            encoded += dt * w;
            const double line = std::floor((d.differenced != 0 ? rig.s[angle] : encoded) / d.encoder + 0.5);
            w = (line - last_line) * d.encoder / dt;
            last_line = line;
        }
        velocity[i] = w;
        double u = command ? controller.step(i, measured ? measured[i] : w, rig.s[angle]) : given[i];
        torque[i] = u;
        u = clamp(u, d.saturation);
        acted[static_cast<std::size_t>(i)] = std::abs(u) <= d.dead_band ? 0 : u - d.dead_band * sign(u);
        if (torque_noise) rig.disturbed = torque_noise[i];
        if (part > 0) {
            rig.held = at(i - whole - 1);
            rig.advance(i * dt, part, before);
        }
        rig.held = at(i - whole);
        rig.advance(i * dt + part, dt - part, after);
    }
    return 0;
}
