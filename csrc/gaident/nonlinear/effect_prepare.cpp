#include "effect_prepare.hpp"

#include "../simulation/batch.hpp"

namespace gaident {

namespace {

// e^-x and (1 - e^-x)/x for x >= 0 or infinite.
struct Decay {
    double power, mean;

    explicit Decay(double x) : power(exp_of_minus(x)), mean(x < 0.5 ? series(x) : (1.0 - power) / x) {}

    static double series(double x) {
        double sum = 0.0;
        for (int k = 14; k >= 1; --k) sum = (1.0 - x * sum) / k;
        return sum;
    }
};

double resonance(const Pair<double>& f) { return f.e1 * f.e1 < 4.0 * f.e0 ? std::sqrt(f.e0) : 0.0; }

// The state of a plant at the substep that continues as `start` does at the sample time. Both are compared by what they do under the
// constant torque u: the differences y, dy, d2y, ... over whole samples. G and H take the state over one sample: dx = G x + H u.
template <std::size_t n_max>
bool same_motion(int n, const double (&G)[n_max][n_max], const double (&H)[n_max], const Delta<double>& plant,
                 const double* start, double u, double* x) {
    double wanted[n_max], z[max_loop_order] = {};
    wanted[0] = start[0] + plant.b[0] * u;
    for (int i = 0; i < n; ++i) z[i] = ((i + 1 < n ? start[i + 1] : 0.0) + plant.b[i + 1] * u) - plant.a[i] * wanted[0];
    for (int k = 1; k < n; ++k) {
        const double d = wanted[k] = z[0];
        for (int i = 0; i < n; ++i) z[i] = (i + 1 < n ? z[i + 1] : 0.0) - plant.a[i] * d;
    }
    // Row k: (G^k) x = wanted[k] - G^(k-1) H u, first component.
    double rows[n_max][n_max + 1] = {};
    double row[n_max] = {1.0};
    for (int k = 0; k < n; ++k) {
        if (k > 0) {
            double next[n_max] = {}, forced = 0.0;
            for (int i = 0; i < n; ++i) {
                forced += row[i] * H[i];
                for (int j = 0; j < n; ++j) next[j] += row[i] * G[i][j];
            }
            wanted[k] -= forced * u;
            std::copy(next, next + n, row);
        }
        double size = 0.0;
        for (int j = 0; j < n; ++j) size = std::max(size, std::abs(row[j]));
        if (!(size > 0.0)) return false;
        for (int j = 0; j < n; ++j) rows[k][j] = row[j] / size;
        rows[k][n] = wanted[k] / size;
    }
    for (int c = 0; c < n; ++c) {
        int pivot = c;
        for (int r = c + 1; r < n; ++r)
            if (std::abs(rows[r][c]) > std::abs(rows[pivot][c])) pivot = r;
        if (rows[pivot][c] == 0.0) return false;
        for (int j = 0; j <= n; ++j) std::swap(rows[c][j], rows[pivot][j]);
        for (int r = c + 1; r < n; ++r) {
            const double factor = rows[r][c] / rows[c][c];
            for (int j = c; j <= n; ++j) rows[r][j] -= factor * rows[c][j];
        }
    }
    for (int c = n; c-- > 0;) {
        double sum = rows[c][n];
        for (int j = c + 1; j < n; ++j) sum -= rows[c][j] * x[j];
        x[c] = sum / rows[c][c];
    }
    return true;
}

void observer(const Factors<double>& g, double h, int substeps, const Delta<double>* whole, const double* start, double u,
              EffectConstants<double>& c) {
    const Delta<double> plant = held_plant(g, h, held_doublings(largest_root(g), h));
    const int n = plant.order;
    std::copy(plant.a, plant.a + n, c.a);
    std::copy(plant.b, plant.b + n + 1, c.b);
    if (start == nullptr) return;
    double G[max_plant_order][max_plant_order] = {}, H[max_plant_order] = {};
    for (int s = 0; s < substeps; ++s) {
        // G + A + A G and H + B + A H with A x = (x[i+1] - a[i] x[0])
        double next[max_plant_order][max_plant_order] = {}, pushed[max_plant_order] = {};
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                const double A = (j == i + 1 ? 1.0 : 0.0) - (j == 0 ? plant.a[i] : 0.0);
                next[i][j] = ((i + 1 < n ? G[i + 1][j] : 0.0) - plant.a[i] * G[0][j]) + (G[i][j] + A);
            }
            pushed[i] = ((i + 1 < n ? H[i + 1] : 0.0) - plant.a[i] * H[0]) + (H[i] + plant.b[i + 1]);
        }
        std::copy(&next[0][0], &next[0][0] + max_plant_order * max_plant_order, &G[0][0]);
        std::copy(pushed, pushed + n, H);
    }
    if (!same_motion(n, G, H, *whole, start, u, c.x)) std::fill(c.x, c.x + n, any_value);
}

void two_masses(const EffectModel& model, double h, double sample_time, const Delta<double>* whole, const double* start, double u,
                EffectConstants<double>& c) {
    TwoMasses m{};
    if (!two_masses_of(model.linear, m)) {
        c.x[0] = any_value;  // no such mechanism: as good as diverged
        return;
    }
    const TwoMassStep step = two_mass_step(m, h);
    std::copy(&step.phi[0][0], &step.phi[0][0] + 9, &c.phi[0][0]);
    std::copy(step.motor, step.motor + 3, c.motor);
    std::copy(step.coupling, step.coupling + 3, c.coupling);
    c.KG = m.KG;
    c.DG = m.DG;
    c.per_scale = 1.0 / step.scale;
    c.half_gap = model.effects.has(Effect::backlash) ? 0.5 * model.of(Effect::backlash)[0] : 0.0;
    c.cubic = model.effects.has(Effect::hardening_stiffness) ? model.of(Effect::hardening_stiffness)[0] : 0.0;
    if (start == nullptr) return;
    const TwoMassStep sample = two_mass_step(m, sample_time);
    if (!same_motion(3, sample.phi, sample.motor, *whole, start, u, c.x)) std::fill(c.x, c.x + 3, any_value);
    // The nonlinear coupling carries the same torque: K x + k3 x^3 = K x_linear beyond the gap.
    const double linear = c.x[2] / sample.scale;
    double x = linear;
    for (int i = 0; i < 50 && c.cubic > 0.0; ++i)
        x -= (m.KG * (x - linear) + c.cubic * x * x * x) / (m.KG + 3.0 * c.cubic * x * x);
    if (linear != 0.0) c.x[2] = (x + std::copysign(c.half_gap, linear)) * step.scale;
}

}  // namespace

EffectModel reduced(const EffectModel& model, bool moving) {
    EffectModel r = model;
    for (int i = 0; i < effect_count; ++i) {
        const auto e = static_cast<Effect>(i);
        if (moving && e == Effect::extra_resonance) continue;
        if (r.effects.has(e) && effect_table[static_cast<std::size_t>(i)].neutral(r.of(e))) r.effects.remove(e);
    }
    if (r.effects.has(Effect::extra_resonance)) {
        r.linear = ExtraResonance::times(r.linear, r.of(Effect::extra_resonance));
        r.effects.remove(Effect::extra_resonance);
    }
    return r;
}

int substeps_for(const EffectModel& model, const EffectRecord& record, const Loop& loop, bool own) {
    using enum Effect;
    const Factors<double>& g = model.linear;
    const double Ts = record.sample_time;
    double wanted = 1.0;
    const bool in_time =
        own || model.effects.has_any(coulomb_friction, stribeck_friction, asymmetric_friction, presliding_friction,
                                     quadratic_drag, unbalance, cogging, friction_drift, backlash, hardening_stiffness,
                                     transport_delay, torque_lag, velocity_filter);
    if (in_time) {
        double fastest = 0.0;
        for (int i = 0; i < g.structure.pole_pairs(); ++i) fastest = std::max(fastest, resonance(g.pole_pair[i]));
        for (int i = 0; i < g.structure.zero_pairs(); ++i) fastest = std::max(fastest, resonance(g.zero_pair[i]));
        // A nonlinear coupling is part of the resonance itself, and a friction that falls with speed drives it: both need finer steps.
        const bool finer = model.effects.has_any(backlash, hardening_stiffness, stribeck_friction);
        wanted = std::max({wanted, finer ? 4.0 : 2.0, fastest * Ts / (finer ? 0.0215 : 0.045)});
    }
    const auto turning = [&](double order) { wanted = std::max(wanted, order * record.top_speed * Ts / 0.3); };
    if (model.effects.has(unbalance)) turning(1.0);
    if (model.effects.has(cogging)) turning(model.of(cogging)[1]);
    if (model.effects.has(presliding_friction) && g.structure.p == 1)
        wanted = std::max(wanted, std::sqrt(std::abs(g.gain * model.of(presliding_friction)[1])) * Ts / 0.3);
    if (loop.kind == LoopKind::continuous && g.structure.p == 1)
        wanted = std::max({wanted, model.effects.has(torque_dead_band) ? 16.0 : 8.0, std::abs(g.gain * loop.kp) * Ts / 0.06});
    int m = 1;
    while (m < wanted && m < 16) m *= 2;
    return m;
}

void prepare_effects(const EffectModel& model, const EffectRecord& record, const Loop& loop, int substeps, const double* start,
                     PreparedEffects& out) {
    using enum Effect;
    const Structure s = model.linear.structure;
    if (s.p < 1) throw std::invalid_argument("poles: a model with effects needs more poles than zeros");
    const double Ts = record.sample_time, h = Ts / substeps;
    const bool continuous = loop.kind == LoopKind::continuous, open = loop.kind == LoopKind::open;
    const double hold = continuous ? h : Ts;
    EffectConstants<double>& c = out.constants;
    c = EffectConstants<double>{};

    const bool moving = start != nullptr;
    const double u = moving && !open ? start[s.poles()] : 0.0;
    c.stored = u;
    c.before = !moving ? 0.0 : open && !record.input.empty() ? record.input[0] : u;
    Delta<double> whole;
    if (moving) whole = plant_of(model.linear, loop, Ts);
    out.two_masses = model.effects.has_any(backlash, hardening_stiffness);
    if (out.two_masses) two_masses(model, h, Ts, &whole, start, u, c);
    else observer(model.linear, h, substeps, &whole, start, u, c);

    const auto with = [&](Effect e, auto&& take) {
        if (model.effects.has(e)) take(model.of(e));
    };
    with(coulomb_friction, [&](const double* p) { CoulombFriction::add(p, c.law); });
    with(asymmetric_friction, [&](const double* p) { AsymmetricFriction::add(p, c.law); });
    with(quadratic_drag, [&](const double* p) { QuadraticDrag::add(p, c.law); });
    with(stribeck_friction, [&](const double* p) {
        c.stribeck_torque = p[0];
        c.stribeck_static = p[1];
        c.stribeck_slowness = 1.0 / p[2];
    });
    with(presliding_friction, [&](const double* p) {
        c.bristle_torque = p[0];
        c.bristle_stiffness = p[1];
        c.bristle_per_break = p[1] / p[0];
    });
    with(friction_drift, [&](const double* p) { c.drift_torque = p[0], c.drift_rate = p[1]; });
    with(load_torque, [&](const double* p) { c.load = p[0]; });
    with(unbalance, [&](const double* p) { c.unbalance_amplitude = p[0], c.unbalance_phase = p[1]; });
    with(cogging, [&](const double* p) { c.cogging_amplitude = p[0], c.cogging_order = p[1], c.cogging_phase = p[2]; });
    with(torque_saturation, [&](const double* p) { c.saturation = p[0]; });
    with(torque_dead_band, [&](const double* p) { c.dead_band = p[0]; });
    with(torque_lag, [&](const double* p) {
        const Decay decay(h / p[0]);
        c.lag_decay = decay.power;
        c.lag_mean = decay.mean;
    });
    with(integrator_clamp, [&](const double* p) { c.integrator_limit = p[0]; });
    with(command_rate_limit, [&](const double* p) { c.rate_step = p[0] * hold; });
    with(velocity_filter, [&](const double* p) {
        const Decay decay(h / p[0]);
        c.filter_decay = decay.power;
        c.filter_new = 1.0 - decay.mean;
        c.filter_old = decay.mean - decay.power;
    });
    with(velocity_ripple, [&](const double* p) { c.ripple_amplitude = p[0], c.ripple_order = p[1], c.ripple_phase = p[2]; });
    with(velocity_quantisation, [&](const double* p) { c.quantum = p[0]; });

    const double delay = model.effects.has(transport_delay) ? model.of(transport_delay)[0] : 0.0;
    const bool usable = delay >= 0.0 && delay <= longest_delay;
    const int steps = continuous ? 1 : substeps;
    for (int j = 0; j < steps; ++j)
        TransportDelay::mean(usable ? delay : 0.0, hold, j, steps, out.delay.back[j], out.delay.share[j]);
    if (!usable) c.x[0] = any_value;
}

}  // namespace gaident
