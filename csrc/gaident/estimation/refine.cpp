#include "refine.hpp"

#include "../numeric/denormals.hpp"
#include "../numeric/linear.hpp"
#include "parameters.hpp"

#include <algorithm>
#include <cmath>

namespace gaident {

namespace {

constexpr std::size_t W = Chunk::width;
using Vector = std::vector<double>;

// v'v, J'v and J'J, row-major.
struct Normal {
    double cost = 0.0;
    Vector gradient, curvature;
};

// One fit on its way, with its memory.
class Descent {
public:
    Descent(const Experiment& experiment, const RefineOptions& options, const Unknowns& unknowns)
        : experiment_(experiment), options_(options), unknowns_(unknowns), sweep_(experiment) {}

    Normal normal(const Vector& x);
    // A step of every damping lane from x; trial[lane] are the points.
    void trials(const Vector& x, const Normal& m, double damping, Vector& trial);
    void errors(const Vector& trial, double* sums) {
        const double* points[W];
        for (std::size_t l = 0; l < W; ++l) points[l] = trial.data() + l * unknowns_.count;
        sweep_.errors(points, unknowns_, options_.whitening, sums);
    }

private:
    std::vector<bool> at_bound(const Vector& x, const Normal& m);

    const Experiment& experiment_;
    const RefineOptions& options_;
    const Unknowns& unknowns_;
    Sweep sweep_;
    Vector blocks_, white_, wanted_, probe_, A_, b_, step_, work_;
};

Normal Descent::normal(const Vector& x) {
    const std::size_t P = x.size();
    Normal m{0.0, Vector(P, 0.0), Vector(P * P, 0.0)};
    const auto block = [&](std::size_t g, std::size_t h) { return blocks_.data() + (g * (g + 1) / 2 + h) * W * W; };
    sweep_.linearise(x, unknowns_, options_.whitening.size(), [&](const Chunk& c) {
        const std::size_t groups = c.groups();
        const bool filtered = !options_.whitening.empty() && !c.response;
        if (c.first == 0) blocks_.assign(groups * (groups + 1) / 2 * W * W, 0.0);
        if (filtered) white_.resize(groups * chunk_samples * W);
        const auto rows = [&](std::size_t g) -> const double* {
            return filtered ? white_.data() + g * chunk_samples * W : c.rows(g);
        };
        for (std::size_t g = 0; g < groups; ++g) {
            if (filtered)
                Sweep::whiten(experiment_, options_.whitening, c.first, c.n, c.rows(g), white_.data() + g * chunk_samples * W);
            for (std::size_t h = 0; h <= g; ++h) experiment_.kernels->gram(rows(g), rows(h), c.n, block(g, h));
        }
        if (!c.is_last()) return;
        // The record is through: its sums go where its unknowns stand.
        m.cost += block(0, 0)[0];
        for (std::size_t i = 0; i < c.unknowns.size(); ++i) {
            const std::size_t g = i / Chunk::per_group, li = i % Chunk::per_group + 1;
            m.gradient[c.unknowns[i]] += block(g, g)[li * W];
            for (std::size_t j = 0; j <= i; ++j) {
                const std::size_t h = j / Chunk::per_group, lj = j % Chunk::per_group + 1;
                m.curvature[c.unknowns[i] * P + c.unknowns[j]] += block(g, h)[li * W + lj];
            }
        }
    });
    for (std::size_t j = 0; j < P; ++j)
        for (std::size_t i = 0; i < j; ++i) m.curvature[i * P + j] = m.curvature[j * P + i];
    return m;
}

// A parameter at its bound with the descent direction pointing outward takes no part in a step: found by projecting a small step
// along the negative gradient.
std::vector<bool> Descent::at_bound(const Vector& x, const Normal& m) {
    const std::size_t P = x.size();
    std::vector<bool> found(P, false);
    if (!options_.bounded) return found;
    wanted_ = x;
    for (std::size_t j = 0; j < P; ++j) {
        const double c = m.curvature[j * P + j];
        if (c > 0.0) wanted_[j] -= 1e-3 * m.gradient[j] / c;
    }
    probe_ = wanted_;
    project(probe_, unknowns_.structure, options_.ranges);
    for (std::size_t j = 0; j < P; ++j)
        found[j] = wanted_[j] != x[j] && std::abs(probe_[j] - x[j]) < 1e-6 * std::abs(wanted_[j] - x[j]);
    return found;
}

void Descent::trials(const Vector& x, const Normal& m, double damping, Vector& trial) {
    const std::size_t P = x.size();
    const std::vector<bool> fixed = at_bound(x, m);
    A_ = m.curvature;
    b_.resize(P);
    for (std::size_t j = 0; j < P; ++j) {
        b_[j] = fixed[j] ? 0.0 : -m.gradient[j];
        if (!fixed[j]) continue;
        for (std::size_t i = 0; i < P; ++i) A_[j * P + i] = A_[i * P + j] = 0.0;
        A_[j * P + j] = 1.0;
    }
    double factors[damping_lanes];
    double factor = damping * 1e-3;
    for (double& f : factors) {
        f = factor;
        factor *= 10.0;
    }
    step_.resize(P * damping_lanes);
    solve_damped(A_, b_, factors, work_, step_);
    trial.resize(W * P);
    for (std::size_t l = 0; l < W; ++l) {
        const std::span<double> t(trial.data() + l * P, P);
        for (std::size_t j = 0; j < P; ++j) t[j] = x[j] + step_[j * damping_lanes + l];
        if (options_.bounded) project(t, unknowns_.structure, options_.ranges);
    }
}

}  // namespace

Refined Refiner::fit(const Factors<double>& g, const std::vector<double>& starts, int max_iterations) const {
    Refined from;
    from.factors = g;
    from.starts = starts.empty() ? Unknowns(experiment_, g.structure).steady_starts(experiment_, g) : starts;
    return go_on(from, max_iterations);
}

Refined Refiner::go_on(const Refined& from, int max_iterations) const {
    const FlushDenormals flush;
    const Structure s = from.factors.structure;
    const Unknowns unknowns(experiment_, s);
    Vector x = pack(from.factors, from.starts);
    if (x.size() != unknowns.count) throw std::invalid_argument("starts: wrong number of start states for these records");
    if (options_.bounded) project(x, s, options_.ranges);
    Refined result;
    Descent descent(experiment_, options_, unknowns);
    Vector trial;
    double damping = from.damping, costs[W];
    int unchanged = 0;
    if (max_iterations == 0) {
        for (std::size_t l = 0; l < W; ++l) trial.insert(trial.end(), x.begin(), x.end());
        descent.errors(trial, costs);
    }
    Normal m = max_iterations > 0 ? descent.normal(x) : Normal{costs[0], {}, {}};
    for (; result.iterations < max_iterations && m.cost < worst_error_sum; ++result.iterations) {
        descent.trials(x, m, damping, trial);
        descent.errors(trial, costs);
        const auto best = static_cast<std::size_t>(std::min_element(costs, costs + W) - costs);
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
        x.assign(trial.begin() + static_cast<std::ptrdiff_t>(best * x.size()),
                 trial.begin() + static_cast<std::ptrdiff_t>((best + 1) * x.size()));
        m.cost = costs[best];
        unchanged = fall < options_.tolerance ? unchanged + 1 : 0;
        if (unchanged >= 2 || m.cost == 0.0) {
            ++result.iterations;
            result.converged = true;
            break;
        }
        if (result.iterations + 1 < max_iterations) m = descent.normal(x);
    }
    result.factors = unpack(x, s);
    result.starts.assign(x.begin() + s.parameters(), x.end());
    result.cost = sane(m.cost);
    result.damping = damping;
    result.iterations += from.iterations;
    if (options_.bounded) result.at_bound = at_bounds(x, s, options_.ranges);
    else result.at_bound.assign(static_cast<std::size_t>(s.parameters()), false);
    return result;
}

std::vector<double> Refiner::costs(std::span<const Factors<double>> candidates) const {
    const FlushDenormals flush;
    // Candidates of one structure run together.
    std::vector<std::size_t> first{0};
    while (first.back() < candidates.size()) {
        std::size_t i = first.back() + 1;
        while (i < candidates.size() && i < first.back() + W && candidates[i].structure == candidates[first.back()].structure)
            ++i;
        first.push_back(i);
    }
    std::vector<double> result(candidates.size());
    experiment_.share(first.size() - 1, [&](std::size_t k) {
        const std::span<const Factors<double>> group = candidates.subspan(first[k], first[k + 1] - first[k]);
        const Unknowns unknowns(experiment_, group[0].structure);
        std::vector<Vector> x;
        const double* points[W];
        for (const Factors<double>& g : group) x.push_back(pack(g, unknowns.steady_starts(experiment_, g)));
        for (std::size_t i = 0; i < x.size(); ++i) points[i] = x[i].data();
        Sweep(experiment_).errors({points, x.size()}, unknowns, options_.whitening, result.data() + first[k]);
    });
    return result;
}

void Refiner::sensitivities(const Factors<double>& g, const std::vector<double>& starts, std::vector<double>& error,
                            std::vector<double>& columns) const {
    const FlushDenormals flush;
    const Unknowns unknowns(experiment_, g.structure);
    const Vector x = pack(g, starts.empty() ? unknowns.steady_starts(experiment_, g) : starts);
    if (x.size() != unknowns.count) throw std::invalid_argument("starts: wrong number of start states for these records");
    const std::size_t total = experiment_.samples();
    error.assign(total, 0.0);
    columns.assign(x.size() * total, 0.0);
    std::size_t at = 0;
    Vector white(chunk_samples * W);
    Sweep(experiment_).linearise(x, unknowns, options_.whitening.size(), [&](const Chunk& c) {
        for (std::size_t group = 0; group < c.groups(); ++group) {
            if (c.response) std::copy_n(c.rows(group), c.n * W, white.begin());
            else Sweep::whiten(experiment_, options_.whitening, c.first, c.n, c.rows(group), white.data());
            for (std::size_t k = 0; k < c.n; ++k) error[at + k] = white[k * W];
            const std::size_t from = group * Chunk::per_group;
            for (std::size_t i = from; i < std::min(from + Chunk::per_group, c.unknowns.size()); ++i)
                for (std::size_t k = 0; k < c.n; ++k) columns[c.unknowns[i] * total + at + k] = white[k * W + i - from + 1];
        }
        at += c.n;
    });
}

}  // namespace gaident
