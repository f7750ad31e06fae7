#include "refine.hpp"

#include "linear.hpp"
#include "parameters.hpp"

#include <algorithm>
#include <cmath>

namespace gaident {

struct Refiner::Normal {
    double cost = 0.0;
    Vector gradient, curvature;  // J^T v and J^T J
};

Refiner::Refiner(const Experiment& experiment, RefineOptions options)
    : experiment_(experiment), options_(std::move(options)), slowest_(0.0) {
    double longest = 0.0;
    for (const Record& r : experiment.records)
        longest = std::max(longest, static_cast<double>(r.size()) * r.sample_time);
    slowest_ = 1.0 / longest;
}

int Refiner::parameters(Structure s) const {
    int n = s.parameters();
    for (const Record& r : experiment_.records)
        if (r.start == Start::free) n += start_states(s, experiment_.loop);
    return n;
}

Refiner::Vector Refiner::default_starts(const Factors<double>& g) const {
    Vector starts;
    for (const Record& r : experiment_.records) {
        if (r.start != Start::free) continue;
        const Delta<double> plant = plant_of(g, experiment_.loop, r.sample_time);
        double x[max_loop_order + 1] = {};
        steady_start(plant, r, experiment_.loop, x);
        starts.insert(starts.end(), x, x + start_states(g.structure, experiment_.loop));
    }
    return starts;
}

// Memory of one fit, taken once.
struct Refiner::Scratch {
    std::vector<DoubleGroup> bank;
    std::vector<double> rows;     // outputs of one group, [sample][lane]
    std::vector<double> columns;  // outputs by point, [point][history + sample]
    std::vector<double> white;    // whitened error and derivatives, [point][sample]
};

void Refiner::load(const std::vector<Vector>& points, Structure s, std::size_t r, Scratch& scratch) const {
    constexpr std::size_t W = double_lanes;
    const Record& record = experiment_.records[r];
    scratch.bank.resize((points.size() + W - 1) / W);
    std::size_t offset = static_cast<std::size_t>(s.parameters());
    for (std::size_t k = 0; k < r; ++k)
        if (experiment_.records[k].start == Start::free) offset += static_cast<std::size_t>(start_states(s, experiment_.loop));
    const bool free = record.start == Start::free;
    for (std::size_t g = 0; g < scratch.bank.size(); ++g) {
        const std::size_t used = std::min(W, points.size() - g * W);
        Factors<double> models[W];
        const Factors<double>* lanes[W];
        const double* starts[W];
        for (std::size_t i = 0; i < used; ++i) {
            models[i] = unpack(points[g * W + i], s);
            lanes[i] = &models[i];
            starts[i] = points[g * W + i].data() + offset;
        }
        load_group(experiment_, record, {lanes, used}, {starts, free ? used : 0}, scratch.bank[g]);
    }
}

// Simulates all points over all records in chunks and calls on_chunk(record, first sample, n) with scratch.columns filled: point i's
// outputs from columns[i * stride + history] on, the history of the whitening in front of them.
template <class OnChunk>
void Refiner::run(const std::vector<Vector>& points, Structure s, Scratch& scratch, OnChunk&& on_chunk) const {
    constexpr std::size_t W = double_lanes;
    const std::size_t history = options_.whitening.size(), stride = history + chunk_samples;
    scratch.rows.resize(chunk_samples * W);
    scratch.columns.resize(points.size() * stride);
    for (std::size_t r = 0; r < experiment_.records.size(); ++r) {
        const Record& record = experiment_.records[r];
        const Controller<double> controller(experiment_.loop, record.sample_time);
        load(points, s, r, scratch);
        for (std::size_t first = 0; first < record.size(); first += chunk_samples) {
            const std::size_t n = std::min(chunk_samples, record.size() - first);
            const double* const in = record.input.data() + first;
            for (std::size_t g = 0; g < scratch.bank.size(); ++g) {
                if (experiment_.loop.limited())
                    experiment_.kernels->in_double.stepped_outputs(scratch.bank[g], controller, in, n, scratch.rows.data());
                else experiment_.kernels->in_double.outputs(scratch.bank[g], in, n, scratch.rows.data());
                for (std::size_t i = g * W; i < std::min((g + 1) * W, points.size()); ++i) {
                    double* const column = scratch.columns.data() + i * stride;
                    if (first > 0) std::copy(column + chunk_samples, column + stride, column);
                    for (std::size_t k = 0; k < n; ++k) column[history + k] = scratch.rows[k * W + i % W];
                }
            }
            on_chunk(r, first, n);
            experiment_.stop_if_asked();
        }
    }
}

namespace {

// out(n) = v(n) - sum phi_i v(n-i), v with its history in front. The first samples of a record, whose history is missing, are left
// out (zero).
void whiten(const std::vector<double>& phi, std::size_t first, std::size_t n, const double* v, double* out) {
    std::copy(v, v + n, out);
    for (std::size_t i = 0; i < phi.size(); ++i) {
        const double* const past = v - 1 - static_cast<std::ptrdiff_t>(i);
        for (std::size_t k = 0; k < n; ++k) out[k] -= phi[i] * past[k];
    }
    if (first < phi.size()) std::fill(out, out + std::min(n, phi.size() - first), 0.0);
}

}  // namespace

std::vector<double> Refiner::evaluate(const std::vector<Vector>& points, Structure s, Scratch& scratch) const {
    constexpr std::size_t W = double_lanes;
    std::vector<double> costs(points.size(), 0.0);
    if (options_.whitening.empty()) {
        for (std::size_t r = 0; r < experiment_.records.size(); ++r) {
            const Record& record = experiment_.records[r];
            const Controller<double> controller(experiment_.loop, record.sample_time);
            load(points, s, r, scratch);
            for (std::size_t first = 0; first < record.size(); first += chunk_samples) {
                const std::size_t n = std::min(chunk_samples, record.size() - first);
                const double *const in = record.input.data() + first, *const out = record.output.data() + first;
                for (std::size_t g = 0; g < scratch.bank.size(); ++g) {
                    double part[W];
                    if (experiment_.loop.limited())
                        experiment_.kernels->in_double.stepped_errors(scratch.bank[g], controller, in, out, n, part);
                    else experiment_.kernels->in_double.errors(scratch.bank[g], in, out, n, part);
                    for (std::size_t i = g * W; i < std::min((g + 1) * W, points.size()); ++i) costs[i] += part[i % W];
                }
                experiment_.stop_if_asked();
            }
        }
    } else {
        const std::size_t history = options_.whitening.size(), stride = history + chunk_samples;
        scratch.white.resize(chunk_samples);
        run(points, s, scratch, [&](std::size_t r, std::size_t first, std::size_t n) {
            for (std::size_t i = 0; i < points.size(); ++i) {
                double* const column = scratch.columns.data() + i * stride;
                to_error(r, first, n, column);
                whiten(options_.whitening, first, n, column + history, scratch.white.data());
                costs[i] += dot(scratch.white.data(), scratch.white.data(), n);
            }
        });
    }
    for (double& c : costs) c = sane(c);
    return costs;
}

// Turns a column of outputs, history included, into errors; a history of errors stays as it is.
void Refiner::to_error(std::size_t r, std::size_t first, std::size_t n, double* column) const {
    const double* const output = experiment_.records[r].output.data() + first;
    double* const fresh = column + options_.whitening.size();
    for (std::size_t k = 0; k < n; ++k) fresh[k] = output[k] - fresh[k];
}

// Whitened error (column 0) and derivatives (columns 1..P) of every chunk in scratch.white, by forward differences.
template <class OnChunk>
void Refiner::linearise(const Vector& x, Structure s, Scratch& scratch, OnChunk&& on_chunk) const {
    const std::size_t P = x.size(), history = options_.whitening.size(), stride = history + chunk_samples;
    std::vector<Vector> points(P + 1, x);
    Vector scale(P);
    for (std::size_t i = 0; i < P; ++i) {
        points[i + 1][i] += step_size(x, s, slowest_, i);
        scale[i] = 1.0 / (points[i + 1][i] - x[i]);
    }
    scratch.white.resize((P + 1) * chunk_samples);
    run(points, s, scratch, [&](std::size_t r, std::size_t first, std::size_t n) {
        for (std::size_t i = 0; i <= P; ++i) to_error(r, first, n, scratch.columns.data() + i * stride);
        for (std::size_t i = 0; i <= P; ++i)
            whiten(options_.whitening, first, n, scratch.columns.data() + i * stride + history, scratch.white.data() + i * chunk_samples);
        const double* const v = scratch.white.data();
        for (std::size_t j = 0; j < P; ++j) {
            double* const column = scratch.white.data() + (j + 1) * chunk_samples;
            for (std::size_t k = 0; k < n; ++k) column[k] = scale[j] * (column[k] - v[k]);
        }
        on_chunk(r, first, n);
    });
}

Refiner::Normal Refiner::normal(const Vector& x, Structure s, Scratch& scratch) const {
    const std::size_t P = x.size();
    Normal m{0.0, Vector(P, 0.0), Vector(P * P, 0.0)};
    linearise(x, s, scratch, [&](std::size_t, std::size_t, std::size_t n) {
        const double* const v = scratch.white.data();
        m.cost += dot(v, v, n);
        for (std::size_t j = 0; j < P; ++j) {
            const double* const column = v + (j + 1) * chunk_samples;
            m.gradient[j] += dot(column, v, n);
            for (std::size_t i = 0; i <= j; ++i) m.curvature[j * P + i] += dot(column, v + (i + 1) * chunk_samples, n);
        }
    });
    for (std::size_t j = 0; j < P; ++j)
        for (std::size_t i = 0; i < j; ++i) m.curvature[i * P + j] = m.curvature[j * P + i];
    return m;
}

void Refiner::sensitivities(const Factors<double>& g, const std::vector<double>& starts, std::vector<double>& error,
                            std::vector<double>& columns) const {
    const Vector x = pack(g, starts.empty() ? default_starts(g) : starts);
    const std::size_t P = x.size(), total = experiment_.samples();
    error.assign(total, 0.0);
    columns.assign(P * total, 0.0);
    Scratch scratch;
    std::size_t at = 0;
    linearise(x, g.structure, scratch, [&](std::size_t, std::size_t, std::size_t n) {
        const double* const v = scratch.white.data();
        std::copy(v, v + n, error.data() + at);
        for (std::size_t j = 0; j < P; ++j)
            std::copy(v + (j + 1) * chunk_samples, v + (j + 1) * chunk_samples + n, columns.data() + j * total + at);
        at += n;
    });
}

std::vector<double> Refiner::costs(std::span<const Factors<double>> candidates) const {
    std::vector<double> result;
    // Candidates of one structure run together.
    std::vector<Vector> points;
    Scratch scratch;
    for (std::size_t i = 0; i < candidates.size();) {
        const Structure s = candidates[i].structure;
        points.clear();
        for (; i < candidates.size() && candidates[i].structure == s; ++i)
            points.push_back(pack(candidates[i], default_starts(candidates[i])));
        const std::vector<double> part = evaluate(points, s, scratch);
        result.insert(result.end(), part.begin(), part.end());
    }
    return result;
}

Refined Refiner::fit(const Factors<double>& g, std::vector<double> starts, int max_iterations) const {
    const Structure s = g.structure;
    Vector x = pack(g, starts.empty() ? default_starts(g) : starts);
    if (options_.bounded) project(x, s, options_.ranges);
    const std::size_t P = x.size();
    Refined result;
    double damping = 1e-2;
    std::vector<Vector> trial(double_lanes);
    Scratch scratch;
    Normal m = normal(x, s, scratch);
    int unchanged = 0;
    for (; result.iterations < max_iterations && m.cost < worst_fitness; ++result.iterations) {
        // A parameter at its bound with the descent direction pointing outward takes no part in this step: found by
        // projecting a small step along the negative gradient.
        Vector probe = x;
        for (std::size_t j = 0; j < P; ++j) {
            const double c = m.curvature[j * P + j];
            if (c > 0.0) probe[j] -= 1e-3 * m.gradient[j] / c;
        }
        const Vector wanted = probe;
        if (options_.bounded) project(probe, s, options_.ranges);
        std::vector<bool> held(P, false);
        for (std::size_t j = 0; j < P; ++j)
            held[j] = wanted[j] != x[j] && std::abs(probe[j] - x[j]) < 1e-6 * std::abs(wanted[j] - x[j]);

        double factor = damping * 1e-3;
        for (Vector& t : trial) {
            Vector A = m.curvature, step(P);
            for (std::size_t j = 0; j < P; ++j) {
                step[j] = held[j] ? 0.0 : -m.gradient[j];
                A[j * P + j] = A[j * P + j] * (1.0 + factor) + 1e-300;
                if (!held[j]) continue;
                for (std::size_t i = 0; i < P; ++i) A[j * P + i] = A[i * P + j] = 0.0;
                A[j * P + j] = 1.0;
            }
            t = x;
            if (solve_spd(A, step, P)) {
                for (std::size_t j = 0; j < P; ++j) t[j] += step[j];
                if (options_.bounded) project(t, s, options_.ranges);
            }
            factor *= 10.0;
        }
        const std::vector<double> costs = evaluate(trial, s, scratch);
        std::size_t best = 0;
        for (std::size_t k = 1; k < costs.size(); ++k)
            if (costs[k] < costs[best]) best = k;
        if (!(costs[best] < m.cost)) {
            // Even the shortest step did not help: an optimum to rounding, or a kink at a bound.
            if (damping > 1e6) {
                result.converged = true;
                break;
            }
            damping *= 1e6;
            continue;
        }
        const double fall = (m.cost - costs[best]) / m.cost;
        damping = std::clamp(damping * std::pow(10.0, static_cast<double>(best) - 3.0), 1e-9, 1e9);
        x = trial[best];
        unchanged = fall < options_.tolerance ? unchanged + 1 : 0;
        if (unchanged >= 2 || costs[best] == 0.0) {
            m.cost = costs[best];
            ++result.iterations;
            result.converged = true;
            break;
        }
        m = normal(x, s, scratch);
    }
    result.factors = unpack(x, s);
    result.starts.assign(x.begin() + s.parameters(), x.end());
    result.cost = sane(m.cost);
    if (options_.bounded) result.at_bound = at_bounds(x, s, options_.ranges);
    else result.at_bound.assign(static_cast<std::size_t>(s.parameters()), false);
    return result;
}

}  // namespace gaident
