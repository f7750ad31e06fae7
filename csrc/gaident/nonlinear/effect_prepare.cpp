#include "effect_prepare.hpp"

#include "../simulation/batch.hpp"

namespace gaident {

namespace {

constexpr double singular = 1e-9;  // modes that end within a substep leave the rounding of those that do not

// Whether a torque changes within a substep, and whether a sensor needs to know how the velocity goes there.
struct Asked {
    bool late, filtered;
};

double resonance(const Pair<double>& f) { return f.e1 * f.e1 < 4.0 * f.e0 ? std::sqrt(f.e0) : 0.0; }

// x of rows [M, y], M x = y, by Gaussian elimination; false where M is singular: no pivot above `least`, its numbers being about 1.
template <std::size_t n_max>
bool solved(int n, double (&rows)[n_max][n_max + 1], double* x, double least) {
    for (int c = 0; c < n; ++c) {
        int pivot = c;
        for (int r = c + 1; r < n; ++r)
            if (std::abs(rows[r][c]) > std::abs(rows[pivot][c])) pivot = r;
        if (!(std::abs(rows[pivot][c]) > least)) return false;
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
    return solved(n, rows, x, 0.0);
}

// The answer y of the observer form's state to a torque that rises by 1 over the substep h, as -1/3 over its first half and 1/3 over its
// second do, which have the same mean and the same first moment; half: the form of half a substep.
// With A x = (x[i+1] - a[i] x[0]) of half a substep the state is then -A b/3; it goes on as the state x of whole substeps does:
//
//     d^k y = x[k] - sum_(j<k) a[j] d^(k-1-j) y,   d y = y(n+1) - y(n)
void answer_to_rise(const Delta<double>& half, const Delta<double>& whole, double* answer) {
    const int n = half.order;
    using State = double[max_plant_order];
    const auto over_half = [&](const State& x, State& dx) {
        for (int i = 0; i < n; ++i) dx[i] = (i + 1 < n ? x[i + 1] : 0.0) - half.a[i] * x[0];
    };
    State x = {}, dx = {}, ddx = {}, y = {};
    for (int i = 0; i < n; ++i) x[i] = -half.b[i + 1] / 3.0;
    over_half(x, dx);
    for (int k = 0; k < n; ++k) {
        answer[k] = y[k] = dx[0];
        for (int j = 0; j < k; ++j) answer[k] += whole.a[j] * y[k - 1 - j];
        std::copy(dx, dx + n, x);
        over_half(x, dx);
        over_half(dx, ddx);
        for (int i = 0; i < n; ++i) dx[i] = 2.0 * dx[i] + ddx[i];
    }
}

// The torque u and the states v[1], v[2], ... before the substep whose answer that is, so that the substep itself does not know of rises:
// of all states the velocity v[0] alone stays as it is, which friction asks for.
// Rows: b[i] u + v[i] + v[i+1] = answer[i] of the observer form.
void same_as_rise(int n, const double* b, const double* answer, double* rise) {
    double rows[max_plant_order][max_plant_order + 1] = {};
    for (int i = 0; i < n; ++i) {
        rows[i][0] = b[i] / b[0];
        if (i > 0) rows[i][i] = 1.0;
        if (i + 1 < n) rows[i][i + 1] = 1.0;
        rows[i][n] = answer[i];
    }
    if (!solved(n, rows, rise, singular)) std::fill(rise, rise + n, 0.0);
    rise[0] /= b[0];
}

// The mean velocity over a substep beside that of its ends, by Simpson's rule with the velocity after half of it,
//
//     1/6 (w + 4 w_half + w+) - 1/2 (w + w+) = 2/3 ((w_half - w) - (w+ - w)/2)
//
// as a sum of the state before it, the velocity w+ at its end, and the rise of its torque: w+ tells the torque, with friction.
// The state x of the substep's form goes on as that of half a substep does where both have the same y, d y, d2 y, ...: with A and B what
// either form makes of its state over a whole substep, a row r of the other form is sum_k z[k] e0 A^k, where r = sum_k z[k] e0 B^k.
// Where modes end within the substep there may be no such z; its ends are then all that is known.
void bend_of(const Delta<double>& half, const Delta<double>& whole, double rise, EffectConstants<double>& c) {
    constexpr std::size_t most = max_plant_order;
    const auto n = static_cast<std::size_t>(half.order);
    using Row = double[most];
    // r A of the observer form: (-sum_i r[i] a[i], r[0], r[1], ...)
    const auto times = [n](const Row& r, const Delta<double>& form, Row& out) {
        out[0] = 0.0;
        for (std::size_t i = 0; i < n; ++i) out[0] -= r[i] * form.a[i];
        for (std::size_t i = 1; i < n; ++i) out[i] = r[i - 1];
    };
    double rows[most][most + 1] = {}, size[most] = {};
    Row r = {1.0}, once = {}, twice = {}, z = {};
    for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t j = 0; j < n; ++j) size[k] = std::max(size[k], std::abs(r[j]));
        if (!(size[k] > 0.0)) return;
        for (std::size_t j = 0; j < n; ++j) rows[j][k] = r[j] / size[k];
        times(r, half, once);
        times(once, half, twice);
        for (std::size_t j = 0; j < n; ++j) r[j] = 2.0 * once[j] + twice[j];
    }
    const Row first = {1.0};
    times(first, half, once);
    for (std::size_t j = 0; j < n; ++j) rows[j][n] = once[j];
    if (!solved(static_cast<int>(n), rows, z, singular)) return;
    Row in_whole = {1.0}, over = {}, next = {};
    times(first, whole, over);
    for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t j = 0; j < n; ++j) c.bend[j] += 2.0 / 3.0 * z[k] / size[k] * in_whole[j];
        times(in_whole, whole, next);
        std::copy(next, next + n, in_whole);
    }
    // A torque of 1 moves w_half by half.b[1] and w+ by whole.b[1].
    const double per_end = 2.0 / 3.0 * half.b[1] / whole.b[1];
    for (std::size_t j = 0; j < n; ++j) c.bend[j] -= per_end * over[j];
    c.bend[0] += 1.0 / 3.0 - per_end;
    c.bend_end[0] = per_end - 1.0 / 3.0;
    c.bend_rise = -half.b[1] / 6.0 - per_end * rise;
}

void observer(const Factors<double>& g, double h, int substeps, const Asked& asked, const Delta<double>* whole,
              const double* start, double u, EffectConstants<double>& c) {
    const Delta<double> plant = held_plant(g, h, held_doublings(largest_root(g), h));
    const int n = plant.order;
    std::copy(plant.a, plant.a + n, c.a);
    std::copy(plant.b, plant.b + n + 1, c.b);
    if (asked.late || asked.filtered) {
        const Delta<double> half = held_plant(g, 0.5 * h, held_doublings(largest_root(g), 0.5 * h));
        double answer[max_plant_order];
        answer_to_rise(half, plant, answer);
        same_as_rise(n, plant.b + 1, answer, c.rise);
        if (asked.filtered) bend_of(half, plant, answer[0], c);
    }
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

// The same of two masses, whose state is the same for half a substep.
// What moves w_M+ and w_L+ beside the state and the rise are two torques, at the motor and at the load: the coupling's correction is
// one at the load and its opposite at the motor.
void rise_and_bend(const TwoMassStep& step, const TwoMassStep& half, EffectConstants<double>& c) {
    double answer[3] = {}, rows[3][4], torques[2][3];
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) answer[i] -= half.phi[i][k] * half.motor[k] / 3.0;
        rows[i][0] = step.motor[i] / step.motor[0];
        for (int k = 1; k < 3; ++k) rows[i][k] = step.phi[i][k] + (i == k ? 1.0 : 0.0);
        rows[i][3] = answer[i];
    }
    if (!solved(3, rows, c.rise, singular)) std::fill(c.rise, c.rise + 3, 0.0);
    c.rise[0] /= step.motor[0];
    // e: of w_half, for w_M+ and w_L+ in the place of the torques
    for (int i = 0; i < 2; ++i) {
        torques[0][i] = step.motor[i];
        torques[1][i] = step.motor[i] + step.coupling[i];
    }
    const double half_of[2] = {half.motor[0], half.motor[0] + half.coupling[0]};
    const double both = torques[0][0] * torques[1][1], det = both - torques[0][1] * torques[1][0];
    if (!(std::abs(det) > singular * std::abs(both))) return;  // whole half periods of an undamped shaft
    const double e[2] = {(half_of[0] * torques[1][1] - torques[0][1] * half_of[1]) / det,
                         (torques[0][0] * half_of[1] - half_of[0] * torques[1][0]) / det};
    for (int i = 0; i < 3; ++i) {
        const double over = e[0] * (step.phi[0][i] + (i == 0 ? 1.0 : 0.0)) + e[1] * (step.phi[1][i] + (i == 1 ? 1.0 : 0.0));
        c.bend[i] = 2.0 / 3.0 * (half.phi[0][i] - over) + (i == 0 ? 1.0 / 3.0 : 0.0);
    }
    c.bend_end[0] = 2.0 / 3.0 * e[0] - 1.0 / 3.0;
    c.bend_end[1] = 2.0 / 3.0 * e[1];
    c.bend_rise = 2.0 / 3.0 * (-0.25 * half.motor[0] - e[0] * answer[0] - e[1] * answer[1]);
}

void two_masses(const EffectModel& model, double h, double sample_time, const Asked& asked, const Delta<double>* whole,
                const double* start, double u, EffectConstants<double>& c) {
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
    if (asked.late || asked.filtered) {
        rise_and_bend(step, two_mass_step(m, 0.5 * h), c);
    }
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
                     PreparedEffects& out, bool both_ends) {
    const Structure s = model.linear.structure;
    if (s.p < 1) throw std::invalid_argument("poles: a model with effects needs more poles than zeros");
    const double Ts = record.sample_time, h = Ts / substeps;
    const bool continuous = loop.kind == LoopKind::continuous, open = loop.kind == LoopKind::open;
    // A change of the inertia is the load's where the mechanism has one.
    const bool inertia = model.effects.meets(effects_with(Hooks::inertia)) && s == Structure{1, 2};
    TwoMasses m{};
    out.two_masses = model.effects.needs_two_masses() || both_ends || inertia;
    const bool load = out.two_masses && two_masses_of(model.linear, m);
    const double samples =
        record.input.empty() ? std::numeric_limits<double>::infinity() : static_cast<double>(record.input.size());
    const PreparedFor made{.step = h,
                           .hold = continuous ? h : Ts,
                           .steps = continuous ? 1 : substeps,
                           .per_sample = substeps,
                           .inertia = load ? m.JL : 1.0 / model.linear.gain,
                           .torques = continuous ? samples * substeps : samples};
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
    const bool averaged = loop.kind == LoopKind::servo && loop.servo.differenced;
    const Asked asked{model.effects.meets(effects_with(Hooks::actuator_dynamics)),
                      averaged || model.effects.meets(effects_with(Hooks::sensor_dynamics))};
    if (out.two_masses) two_masses(model, h, Ts, asked, &whole, start, u, c);
    else observer(model.linear, h, substeps, asked, &whole, start, u, c);
    if (!possible) c.x[0] = any_value;
}

}  // namespace gaident
