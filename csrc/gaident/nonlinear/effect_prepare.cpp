#include "effect_prepare.hpp"

#include "../simulation/batch.hpp"

namespace gaident {

namespace {

double resonance(const Pair<double>& f) { return f.e1 * f.e1 < 4.0 * f.e0 ? std::sqrt(f.e0) : 0.0; }

// The state of a plant at the substep that continues as `start` does at the sample time.
// Both are compared by what they do under the constant torque u: the differences y, dy, d2y, ... over whole samples.
// G and H take the state over one sample: dx = G x + H u.
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
        c.x[0] = any_value;  // no such mechanism: counts as diverged
        return;
    }
    const TwoMassStep step = two_mass_step(m, h);
    std::copy(&step.phi[0][0], &step.phi[0][0] + 9, &c.phi[0][0]);
    std::copy(step.motor, step.motor + 3, c.motor);
    std::copy(step.coupling, step.coupling + 3, c.coupling);
    c.KG = m.KG;
    c.DG = m.DG;
    c.per_scale = 1.0 / step.scale;
    if (start == nullptr) return;
    const TwoMassStep sample = two_mass_step(m, sample_time);
    if (!same_motion(3, sample.phi, sample.motor, *whole, start, u, c.x)) std::fill(c.x, c.x + 3, any_value);
    // The nonlinear coupling carries the same torque: K x + k3 x^3 = K x_linear beyond the gap.
    const double linear = c.x[2] / sample.scale;
    double x = linear;
    Effects::each_backwards([&]<class E>() {
        if constexpr (hook::coupling<E> || hook::hysteresis<E>)
            if (model.effects.has<E>()) x = E::loaded_twist(c.effects.template of<E>(), m.KG, linear, x);
    });
    if (linear != 0.0) c.x[2] = x * step.scale;
}

}  // namespace

EffectModel reduced(const EffectModel& model, bool moving) {
    EffectModel r = model;
    for (int i = 0; i < effect_count; ++i) {
        const auto e = static_cast<Effect>(i);
        if (moving && info_of(e).place == Place::plant) continue;
        if (r.effects.has(e) && info_of(e).neutral(r.of(e))) r.effects.remove(e);
    }
    Effects::each([&]<class E>() {
        if constexpr (hook::plant<E>) {
            if (!r.effects.has<E>()) return;
            r.linear = E::plant(r.of(effect<E>), r.linear);
            r.effects.remove(effect<E>);
        }
    });
    return r;
}

void delay_torque(EffectModel& model, double delay) {
    Effects::each([&]<class E>() {
        if constexpr (hook::later<E>) {
            double* const p = model.of(effect<E>);
            if (!model.effects.has<E>())
                for (int i = 0; i < E::info.count(); ++i) p[i] = E::info.parameters[static_cast<std::size_t>(i)].neutral;
            E::later(p, delay);
            model.effects.add(effect<E>);
        }
    });
}

// These numbers decide how exact a simulation is, and how long it takes: against an integrator that shares no code they leave the
// deviations of docs/effects.md, "How exact it is", which tests/python/models/test_effects.py compares them with.
int substeps_for(const EffectModel& model, const EffectRecord& record, const Loop& loop, bool own) {
    const Factors<double>& g = model.linear;
    const double Ts = record.sample_time;
    TwoMasses m{};
    const bool both_ends = model.effects.meets(effects_with(Hooks::load)) && two_masses_of(g, m);
    const Circumstances at{g, loop, Ts, record.top_speed, g.structure.p == 1 ? g.gain : 0.0, both_ends ? 1.0 / m.JL : 0.0};
    double wanted = 1.0;
    Pace pace = own ? Pace::fine : Pace::sample;
    AllEffects::each([&]<class E>() {
        if (!model.effects.has<E>()) return;
        pace = std::max(pace, E::pace);
        if constexpr (hook::substeps<E>) wanted = std::max(wanted, E::substeps(model.of(effect<E>), at));
    });
    if (pace != Pace::sample) {
        double fastest = 0.0;
        for (int i = 0; i < g.structure.pole_pairs(); ++i) fastest = std::max(fastest, resonance(g.pole_pair[i]));
        for (int i = 0; i < g.structure.zero_pairs(); ++i) fastest = std::max(fastest, resonance(g.zero_pair[i]));
        const bool finer = pace == Pace::finer;
        wanted = std::max({wanted, finer ? 4.0 : 2.0, fastest * Ts / (finer ? 0.0215 : 0.045)});
    }
    if (loop.kind == LoopKind::continuous && g.structure.p == 1)
        wanted = std::max({wanted, 8.0, std::abs(g.gain * loop.controller.kp) * Ts / 0.06});
    int steps = 1;
    while (steps < wanted && steps < 16) steps *= 2;
    return steps;
}

void prepare_effects(const EffectModel& model, const EffectRecord& record, const Loop& loop, int substeps, const double* start,
                     PreparedEffects& out, bool own_at_load) {
    const Structure s = model.linear.structure;
    if (s.p < 1) throw std::invalid_argument("poles: a model with effects needs more poles than zeros");
    const double Ts = record.sample_time, h = Ts / substeps;
    const bool continuous = loop.kind == LoopKind::continuous, open = loop.kind == LoopKind::open;
    // A change of the inertia is the load's where the mechanism has one.
    const bool inertia = model.effects.meets(effects_with(Hooks::inertia)) && s == Structure{1, 2};
    TwoMasses m{};
    out.two_masses = model.effects.needs_two_masses() || own_at_load || inertia;
    const bool load = out.two_masses && two_masses_of(model.linear, m);
    const PreparedFor made{h, continuous ? h : Ts, continuous ? 1 : substeps, substeps, load ? m.JL : 1.0 / model.linear.gain};
    EffectConstants<double>& c = out.constants;
    c = EffectConstants<double>{};

    const bool moving = start != nullptr;
    const double u = moving && !open ? start[s.poles()] : 0.0;
    c.stored = u;
    c.before = open ? record.torque_before : u;
    bool possible = true;
    AllEffects::each([&]<class E>() {
        if (!model.effects.has<E>()) return;
        const double* const p = model.of(effect<E>);
        if constexpr (HasCoefficients<E>) E::prepare(p, made, c.of<E>());
        if constexpr (HasTable<E>) E::tabulate(p, made, out.tables.template of<E>());
        if constexpr (hook::possible<E>) possible = possible && E::possible(p);
    });
    Delta<double> whole;
    if (moving) whole = plant_of(model.linear, loop, Ts);
    if (out.two_masses) two_masses(model, h, Ts, &whole, start, u, c);
    else observer(model.linear, h, substeps, &whole, start, u, c);
    if (!possible) c.x[0] = any_value;
}

}  // namespace gaident
