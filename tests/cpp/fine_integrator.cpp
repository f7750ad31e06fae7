// A drive with effects, integrated finely: what the core is compared with. It shares no code with the library.
//
// Explicit steps of a hundredth of a sample or less, the twist half before and half after the velocity (leapfrog), friction by
// clipping the velocity that the other torques would bring (Moreau), delay by a buffer of fine steps, filters by the midpoint
// rule, the bristle by Heun, an analog controller's torque extrapolated by half a step.
// The equations are those of the public table of effects.
//
// Compiled and called by tests/python/support/fine_integrator.py, which reads the list of fields below.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

struct Shaft {  // effects at one end of the shaft
    // shaft fields
    double coulomb_friction_torque = 0;
    double stribeck_friction_torque = 0;
    double stribeck_friction_static_torque = 0;
    double stribeck_friction_stribeck_velocity = 1;
    double asymmetric_friction_torque_positive = 0;
    double asymmetric_friction_torque_negative = 0;
    double asymmetric_friction_viscous_positive = 0;
    double asymmetric_friction_viscous_negative = 0;
    double presliding_friction_torque = 1;
    double presliding_friction_stiffness = 0;
    double lugre_friction_torque = 1;
    double lugre_friction_static_torque = 1;
    double lugre_friction_stribeck_velocity = 1;
    double lugre_friction_stiffness = 0;
    double lugre_friction_damping = 0;
    double quadratic_drag_coefficient = 0;
    double square_root_drag_coefficient = 0;
    double load_torque_torque = 0;
    double unbalance_amplitude = 0;
    double unbalance_phase = 0;
    double cogging_amplitude = 0;
    double cogging_order = 2;
    double cogging_phase = 0;
    double friction_drift_torque = 0;
    double friction_drift_rate = 0;
    double load_dependent_friction_torque = 0;
    double load_dependent_friction_share = 0;
    double position_friction_torque = 0;
    double position_friction_amplitude = 0;
    double position_friction_order = 1;
    double position_friction_phase = 0;
    double torque_hum_amplitude = 0;
    double torque_hum_frequency = 0;
    double torque_hum_phase = 0;
    // end of shaft fields
};

struct Case {  // SI units, rad; neutral values; effect_parameter
    // fields
    double dt = 1e-3;  // s
    double closed = 0;
    double analog = 0;
    double kp = 0;  // N m s/rad
    double ki = 0;  // N m/rad
    double JM = 1;  // kg m2
    double DM = 0;  // N m s/rad
    double JL = 0;  // 0: one mass
    double DL = 0;
    double K = 0;  // N m/rad
    double D = 0;
    double position_inertia_amplitude = 0;
    double position_inertia_order = 1;
    double position_inertia_phase = 0;
    double backlash_gap = 0;
    double hardening_stiffness_cubic_stiffness = 0;
    double hysteretic_coupling_torque = 1;
    double hysteretic_coupling_stiffness = 0;
    double torque_saturation_limit = inf;
    double torque_dead_band_width = 0;
    double transport_delay_delay = 0;
    double torque_lag_time_constant = 0;
    double integrator_clamp_limit = inf;
    double command_rate_limit_rate = inf;
    double velocity_difference_samples = 0;  // 0: none is taken
    double velocity_observer_bandwidth = inf;
    double velocity_filter_time_constant = 0;
    double velocity_ripple_amplitude = 0;
    double velocity_ripple_order = 1;
    double velocity_ripple_phase = 0;
    double velocity_quantisation_step = 0;
    double extra_resonance_frequency = 1;
    double extra_resonance_damping = 1;
    double extra_resonance_zero_frequency = 1;
    double extra_resonance_zero_damping = 1;
    // end of fields
    Shaft at_motor, at_load;
};

double clip(double x, double limit) { return std::clamp(x, -limit, limit); }

// x less what lies between -width and width.
double beyond(double x, double width) { return std::copysign(std::max(std::abs(x) - width, 0.0), x); }

// A lag in steps of h by the midpoint rule: its share of the way to the input; without a time constant it follows at once.
double share(double h, double time_constant) { return time_constant > 0 ? h / (time_constant + 0.5 * h) : 1; }

// One end of the shaft: what its effects do at velocity w [rad/s] and angle theta [rad].
class End {
public:
    End(const Shaft& its, double step) : c(its), h(step) {}

    // What the torque there is less, before friction.
    double load(double theta) const {
        double T = c.load_torque_torque;
        if (c.unbalance_amplitude != 0) T += c.unbalance_amplitude * std::sin(theta + c.unbalance_phase);
        if (c.cogging_amplitude != 0) T += c.cogging_amplitude * std::sin(c.cogging_order * theta + c.cogging_phase);
        return T;
    }

    // What drives it whatever it does.
    double hum(double t) const {
        constexpr double turn = 6.283185307179586477;
        return c.torque_hum_amplitude * std::sin(turn * c.torque_hum_frequency * t + c.torque_hum_phase);
    }

    // Friction and drag without a jump at standstill.
    double smooth(double w) {
        const double viscous = w > 0 ? c.asymmetric_friction_viscous_positive : c.asymmetric_friction_viscous_negative;
        double T = c.quadratic_drag_coefficient * w * std::abs(w) + viscous * w;
        T += std::copysign(c.square_root_drag_coefficient * std::sqrt(std::abs(w)), w);
        if (const double s0 = c.presliding_friction_stiffness; s0 > 0) {
            const double per_zc = s0 / c.presliding_friction_torque;
            const double half = z + 0.5 * h * (w - std::abs(w) * z * per_zc);
            T += s0 * half;
            z += h * (w - std::abs(w) * half * per_zc);
        }
        if (const double s0 = c.lugre_friction_stiffness; s0 > 0) {
            const double ratio = w / c.lugre_friction_stribeck_velocity, Tc = c.lugre_friction_torque;
            const double g = Tc + (c.lugre_friction_static_torque - Tc) * std::exp(-ratio * ratio);
            const double half = bend + 0.5 * h * (w - s0 * std::abs(w) * bend / g);
            const double rate = w - s0 * std::abs(w) * half / g;
            T += s0 * half + c.lugre_friction_damping * rate;
            bend += h * rate;
        }
        return T;
    }

    // Dry friction at the angle theta, where the other torques bring the velocity `free`, under what those there brake with [N m].
    double level(double w, double free, double t, double theta, double braking) const {
        double T =
            c.coulomb_friction_torque + c.stribeck_friction_torque + c.friction_drift_torque * (1 + c.friction_drift_rate * t);
        T += c.load_dependent_friction_torque + c.load_dependent_friction_share * std::abs(braking);
        T += c.position_friction_torque *
             (1 + c.position_friction_amplitude * std::cos(c.position_friction_order * theta + c.position_friction_phase));
        if (const double more = c.stribeck_friction_static_torque - c.stribeck_friction_torque; more != 0) {
            const double ratio = 0.5 * (w + free) / c.stribeck_friction_stribeck_velocity;
            T += more * std::exp(-ratio * ratio);
        }
        return T + (free > 0 ? c.asymmetric_friction_torque_positive : c.asymmetric_friction_torque_negative);
    }

private:
    const Shaft& c;
    const double h;
    double z = 0, bend = 0;
};

class Drive {
public:
    Drive(const Case& its, int steps)
        : c(its),
          h(c.dt / steps),
          control_time(c.analog != 0 ? h : c.dt),
          motor(c.at_motor, h),
          load(c.at_load, h),
          delay(c.transport_delay_delay / h),
          ring(static_cast<std::size_t>(delay) + 3) {}

    double u = 0;      // of the controller, N m
    double angle = 0;  // of the motor

    // What the sensor shows.
    double sensed() const {
        const double step = c.velocity_quantisation_step;
        const double seen = c.velocity_filter_time_constant > 0 ? filtered : tracking() ? tracked : measured();
        return step > 0 ? std::nearbyint(seen / step) * step : seen;
    }

    // The angle is read, once a sample; the controller of the continuous loop reads it at every step.
    void sample() {
        angles.push_back(angle);
        const double back = c.velocity_difference_samples * c.dt / control_time, whole = std::floor(back);
        const auto at = [&](double samples) {
            const auto i = static_cast<std::size_t>(samples);
            return i < angles.size() ? angles[angles.size() - 1 - i] : angles.front();
        };
        if (back > 0) difference = (angle - at(whole) - (back - whole) * (at(whole + 1) - at(whole))) / (back * control_time);
    }

    void control(double r) {
        command += clip(r - command, c.command_rate_limit_rate * control_time);
        const double e = command - sensed();
        integral = clip(integral + 0.5 * c.ki * control_time * (e + error), c.integrator_clamp_limit);
        error = e;
        u = c.kp * e + integral;
    }

    // One fine step under the torque command v, its middle at time t.
    void step(double v, double t) {
        const double last_measured = measured();
        const double middle = angle + 0.5 * h * w, braking = motor.load(middle);
        const double T = resonant(lagged(late(beyond(clip(v, c.torque_saturation_limit), c.torque_dead_band_width)))) - braking;
        const bool two = c.JL > 0;
        const Inertia one = inertia(c.JM, !two, middle);
        bend(0.5 * h * (w - wL));
        const double Tc = two ? coupling() : 0;
        const double damp = 0.5 * h * c.DM / one.J;
        const double pull_M = T + motor.hum(t) - Tc - motor.smooth(w) - 0.5 * one.slope * w * w;
        const double free = ((1 - damp) * w + h / one.J * pull_M) / (1 + damp);
        const double next = beyond(free, h / one.J * motor.level(w, free, t, middle, braking));
        if (two) {
            const double middle_L = angle_load + 0.5 * h * wL, braking_load = load.load(middle_L);
            const Inertia other = inertia(c.JL, true, middle_L);
            const double damp_L = 0.5 * h * c.DL / other.J;
            const double pull = Tc + load.hum(t) - braking_load - load.smooth(wL) - 0.5 * other.slope * wL * wL;
            const double free_L = ((1 - damp_L) * wL + h / other.J * pull) / (1 + damp_L);
            const double next_L = beyond(free_L, h / other.J * load.level(wL, free_L, t, middle_L, braking_load));
            angle_load += 0.5 * h * (wL + next_L);
            wL = next_L;
        }
        angle += 0.5 * h * (w + next);
        w = next;
        bend(0.5 * h * (w - wL));
        if (tracking()) {  // y' = v, v' = b^2 (x - y) - 2 b v, by the implicit midpoint rule
            const double b = c.velocity_observer_bandwidth, hb = h * b, x = 0.5 * (last_measured + measured());
            const double rate = (2 * tracked_rate + hb * b * (x - tracked)) / (2 + 2 * hb + 0.5 * hb * hb);
            tracked += h * rate;
            tracked_rate = 2 * rate - tracked_rate;
        }
        filtered += share(h, c.velocity_filter_time_constant) * ((tracking() ? tracked : measured()) - filtered);
    }

private:
    // An inertia at an angle, and its slope there.
    struct Inertia {
        double J, slope;
    };
    Inertia inertia(double J, bool changes, double theta) const {
        if (!changes) return {J, 0};
        const double a = J * c.position_inertia_amplitude, n = c.position_inertia_order, psi = n * theta + c.position_inertia_phase;
        return {J + a * std::cos(psi), -a * n * std::sin(psi)};
    }

    bool tracking() const { return c.velocity_observer_bandwidth < inf; }
    double measured() const {
        if (c.velocity_difference_samples > 0) return difference;
        const double order = c.velocity_ripple_order, amplitude = c.velocity_ripple_amplitude;
        return w * (1 + (amplitude != 0 ? amplitude * order * std::cos(order * angle + c.velocity_ripple_phase) : 0));
    }

    const Case& c;
    const double h, control_time;
    End motor, load;
    const double delay;  // fine steps
    std::vector<double> ring;
    std::size_t k = 0;
    double wound = 0;  // of the coupling's own bristle
    std::vector<double> angles;  // of all samples
    double difference = 0, tracked = 0, tracked_rate = 0;
    double w = 0, wL = 0, angle_load = 0, twist = 0, x1 = 0, x2 = 0, lag = 0, filtered = 0, integral = 0, error = 0, command = 0;

    // The torque at the middle of the fine step, `delay` steps ago.
    double late(double v) {
        const auto whole = static_cast<std::size_t>(delay);
        const std::size_t size = ring.size();
        ring[k % size] = v;
        const double after = ring[(k + size - whole) % size], before = ring[(k + size - whole - 1) % size];
        ++k;
        return after + (delay - static_cast<double>(whole)) * (before - after);
    }

    double lagged(double v) {
        if (!(c.torque_lag_time_constant > 0)) return v;
        const double step = share(h, c.torque_lag_time_constant) * (v - lag);
        lag += step;
        return lag - 0.5 * step;
    }

    double resonant(double T) {
        const double wp = c.extra_resonance_frequency, zp = c.extra_resonance_damping;
        const double wz = c.extra_resonance_zero_frequency, zz = c.extra_resonance_zero_damping;
        if (wp == wz && zp == zz) return T;
        const double old1 = x1, old2 = x2;
        x2 += h * (T - 2 * zp * wp * x2 - wp * wp * x1);
        x1 += h * x2;
        // Its mean over the step: at both ends, the half step between x1 and x2 taken back.
        const double x1_mean = 0.5 * (old1 + x1) - 0.5 * h * 0.5 * (x2 - old2);
        return (wp / wz) * (wp / wz) * (T + (zz * wz - zp * wp) * (old2 + x2) + (wz * wz - wp * wp) * x1_mean);
    }

    // The twist goes on by dx.
    void bend(double dx) {
        const double per_zc = c.hysteretic_coupling_stiffness / c.hysteretic_coupling_torque;
        const double half = wound + 0.5 * (dx - std::abs(dx) * wound * per_zc);
        wound += dx - std::abs(dx) * half * per_zc;
        twist += dx;
    }

    double coupling() const {
        const double half_gap = 0.5 * c.backlash_gap, x = beyond(twist, half_gap);
        const double damping = std::abs(twist) < half_gap ? 0 : c.D * (w - wL);
        return c.K * x + c.hardening_stiffness_cubic_stiffness * x * x * x + c.hysteretic_coupling_stiffness * wound + damping;
    }
};

}  // namespace

// `samples` samples in `fine` steps each; source: the command, in open loop the torque. velocity: as the sensor shows it.
extern "C" void fine_integrator(const Case* its, int samples, int fine, const double* source, double* velocity, double* torque,
                                double* angle) {
    const Case& c = *its;
    const bool analog = c.analog != 0, digital = c.closed != 0 && !analog;
    Drive drive(c, fine);
    double before = 0;
    const auto write = [&](int n) {
        velocity[n] = drive.sensed();
        torque[n] = drive.u;
        angle[n] = drive.angle;
    };
    for (int n = 0; n < samples; ++n) {
        const double target = source[n];
        if (!analog) drive.sample();
        if (digital) {
            drive.control(target);
        } else if (!analog) {
            drive.u = target;
        }
        if (!analog) write(n);
        for (int j = 0; j < fine; ++j) {
            const double last = drive.u;
            if (analog) drive.control(before + (target - before) * (static_cast<double>(j) / fine));
            const double middle = (n + (j + 0.5) / fine - (analog ? 1 : 0)) * c.dt;
            drive.step(analog ? 1.5 * drive.u - 0.5 * last : drive.u, std::max(middle, 0.0));
            if (analog) drive.sample();
        }
        before = target;
        if (analog) write(n);  // the continuous loop's sample is the end of the interval
    }
}
