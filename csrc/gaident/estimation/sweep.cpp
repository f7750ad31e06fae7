#include "sweep.hpp"

#include "../simulation/advance.hpp"
#include "parameters.hpp"

#include <algorithm>
#include <numeric>

namespace gaident {

namespace {

constexpr std::size_t W = Chunk::width;
constexpr double two_pi = 6.283185307179586;

// Makes room in front of a chunk: the last rows of the one before, or zeros before the record.
void keep_history(std::vector<double>& rows, std::size_t history, std::size_t first) {
    rows.resize((history + chunk_samples) * W);
    if (first == 0) std::fill_n(rows.begin(), history * W, 0.0);
    else std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(chunk_samples * W), history * W, rows.begin());
}

}  // namespace

Unknowns::Unknowns(const Experiment& experiment, Structure s)
    : structure(s),
      model(static_cast<std::size_t>(s.parameters())),
      states(static_cast<std::size_t>(start_states(s, experiment.loop))),
      count(model) {
    for (const Record& r : experiment.records) {
        starts.push_back(r.start == Start::free ? count : none);
        if (r.start == Start::free) count += states;
    }
}

std::vector<std::size_t> Unknowns::of_record(std::size_t r) const {
    std::vector<std::size_t> all(model + (starts[r] == none ? 0 : states));
    std::iota(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(model), std::size_t{0});
    std::iota(all.begin() + static_cast<std::ptrdiff_t>(model), all.end(), starts[r]);
    return all;
}

std::vector<double> Unknowns::steady_starts(const Experiment& experiment, const Factors<double>& g) const {
    std::vector<double> found;
    for (const Record& r : experiment.records) {
        if (r.start != Start::free) continue;
        double x[max_loop_order + 1] = {};
        steady_start(plant_of(g, experiment.loop, r.sample_time), r, experiment.loop, x);
        found.insert(found.end(), x, x + states);
    }
    return found;
}

Sweep::Sweep(const Experiment& experiment) : experiment_(experiment), slowest_(0.0) {
    double longest = 0.0;
    for (const Record& r : experiment.records) longest = std::max(longest, static_cast<double>(r.size()) * r.sample_time);
    for (const Response* r : experiment.responses) longest = std::max(longest, two_pi / r->slowest());
    slowest_ = 1.0 / longest;
}

void Sweep::load(std::size_t r, std::span<const double* const> points, const Unknowns& unknowns, DoubleGroup& group) const {
    Factors<double> models[W];
    const Factors<double>* lanes[W];
    const double* starts[W];
    const bool free = unknowns.starts[r] != Unknowns::none;
    for (std::size_t i = 0; i < points.size(); ++i) {
        models[i] = unpack({points[i], unknowns.model}, unknowns.structure);
        lanes[i] = &models[i];
        starts[i] = free ? points[i] + unknowns.starts[r] : nullptr;
    }
    load_group(experiment_, experiment_.records[r], {lanes, points.size()}, {starts, free ? points.size() : 0}, group);
}

void Sweep::linearise(std::span<const double> x, const Unknowns& unknowns, std::size_t history, const OnChunk& on_chunk) {
    std::vector<double> scale;
    for (std::size_t r = 0; r < experiment_.records.size(); ++r) {
        const Record& record = experiment_.records[r];
        const ControllerState<double> controller(experiment_.loop.controller, Clock{record.sample_time});
        const std::vector<std::size_t> own = unknowns.of_record(r);
        const std::size_t groups = (own.size() + Chunk::per_group - 1) / Chunk::per_group;
        bank_.resize(groups);
        columns_.resize(groups);
        scale.assign(groups * W, 0.0);
        for (std::size_t g = 0; g < groups; ++g) {
            const double* points[W];
            const std::size_t used = moved(x, unknowns, own, g, points, scale.data() + g * W);
            load(r, {points, used}, unknowns, bank_[g]);
        }
        each_chunk(record, [&](std::size_t first, std::size_t n) {
            for (std::size_t g = 0; g < groups; ++g) {
                keep_history(columns_[g], history, first);
                double* const rows = columns_[g].data() + history * W;
                advance_outputs(*experiment_.kernels, experiment_.loop, controller, bank_[g], record.input.data() + first,
                                record.straight_from(first), n, rows);
                experiment_.kernels->differences(scale.data() + g * W, record.output.data() + first, n, rows);
            }
            on_chunk({r, first, n, record.size(), false, own, columns_, history});
        });
    }
    std::vector<std::size_t> own(unknowns.model);
    std::iota(own.begin(), own.end(), std::size_t{0});
    const std::size_t groups = (own.size() + Chunk::per_group - 1) / Chunk::per_group;
    for (std::size_t i = 0; i < experiment_.responses.size(); ++i) {
        const Response& response = *experiment_.responses[i];
        std::vector<double> numbers(chunk_samples);
        for (std::size_t first = 0; first < response.numbers(); first += chunk_samples) {
            const std::size_t n = std::min(chunk_samples, response.numbers() - first);
            columns_.assign(groups, std::vector<double>((history + chunk_samples) * W, 0.0));
            scale.assign(groups * W, 0.0);
            for (std::size_t g = 0; g < groups; ++g) {
                const double* points[W];
                const std::size_t used = moved(x, unknowns, own, g, points, scale.data() + g * W);
                double* const rows = columns_[g].data() + history * W;
                for (std::size_t lane = 0; lane < used; ++lane) {
                    const Factors<double> model = unpack({points[lane], unknowns.model}, unknowns.structure);
                    response.weighted(model, first / 2, {numbers.data(), n});
                    for (std::size_t k = 0; k < n; ++k) rows[k * W + lane] = numbers[k];
                }
                experiment_.kernels->differences(scale.data() + g * W, response.measured().data() + first, n, rows);
            }
            on_chunk({experiment_.records.size() + i, first, n, response.numbers(), true, own, columns_, history});
        }
        experiment_.stop_if_asked();
    }
}

std::size_t Sweep::moved(std::span<const double> x, const Unknowns& unknowns, std::span<const std::size_t> own, std::size_t group,
                         const double** points, double* scale) {
    const std::size_t used = std::min(W, own.size() - group * Chunk::per_group + 1);
    moved_.resize(used * x.size());
    for (std::size_t lane = 0; lane < used; ++lane) {
        double* const point = moved_.data() + lane * x.size();
        std::copy(x.begin(), x.end(), point);
        points[lane] = point;
        if (lane == 0) continue;
        const std::size_t i = own[group * Chunk::per_group + lane - 1];
        point[i] += step_size(x, unknowns.structure, slowest_, i);
        scale[lane] = 1.0 / (point[i] - x[i]);
    }
    return used;
}

void Sweep::outputs(std::span<const double> x, const Unknowns& unknowns, const OnOutputs& on_outputs) {
    DoubleGroup group;
    std::vector<double> rows(chunk_samples * W), y(chunk_samples);
    const double* const points[] = {x.data()};
    for (std::size_t r = 0; r < experiment_.records.size(); ++r) {
        const Record& record = experiment_.records[r];
        const ControllerState<double> controller(experiment_.loop.controller, Clock{record.sample_time});
        load(r, points, unknowns, group);
        each_chunk(record, [&](std::size_t first, std::size_t n) {
            advance_outputs(*experiment_.kernels, experiment_.loop, controller, group, record.input.data() + first,
                            record.straight_from(first), n, rows.data());
            for (std::size_t k = 0; k < n; ++k) y[k] = rows[k * W];
            on_outputs(r, first, {y.data(), n});
        });
    }
}

void Sweep::errors(std::span<const double* const> points, const Unknowns& unknowns, std::span<const double> phi, double* sums) {
    const std::size_t history = phi.size();
    DoubleGroup group;
    double total[W] = {};
    for (std::size_t r = 0; r < experiment_.records.size(); ++r) {
        const Record& record = experiment_.records[r];
        const ControllerState<double> controller(experiment_.loop.controller, Clock{record.sample_time});
        load(r, points, unknowns, group);
        each_chunk(record, [&](std::size_t first, std::size_t n) {
            const double *const in = record.input.data() + first, *const out = record.output.data() + first;
            double part[W] = {};
            if (phi.empty()) {
                advance_errors(*experiment_.kernels, experiment_.loop, controller, group, in, record.straight_from(first), out, n,
                               part);
            } else {
                keep_history(coloured_, history, first);
                double* const rows = coloured_.data() + history * W;
                advance_outputs(*experiment_.kernels, experiment_.loop, controller, group, in, record.straight_from(first), n,
                                rows);
                for (std::size_t k = 0; k < n; ++k)
                    for (std::size_t lane = 0; lane < W; ++lane) rows[k * W + lane] = out[k] - rows[k * W + lane];
                white_.resize(chunk_samples * W);
                whiten(experiment_, phi, first, n, rows, white_.data());
                for (std::size_t k = 0; k < n; ++k)
                    for (std::size_t lane = 0; lane < W; ++lane) part[lane] += white_[k * W + lane] * white_[k * W + lane];
            }
            for (std::size_t lane = 0; lane < W; ++lane) total[lane] += part[lane];
        });
    }
    for (const Response* r : experiment_.responses)
        for (std::size_t i = 0; i < points.size(); ++i)
            total[i] += r->error_sum(unpack({points[i], unknowns.model}, unknowns.structure));
    for (std::size_t i = 0; i < points.size(); ++i) sums[i] = sane(total[i]);
}

void Sweep::whiten(const Experiment& experiment, std::span<const double> phi, std::size_t first, std::size_t n,
                   const double* rows, double* out) {
    experiment.kernels->whiten(phi.data(), phi.size(), rows, n, out);
    if (first < phi.size()) std::fill(out, out + std::min(n, phi.size() - first) * W, 0.0);
}

}  // namespace gaident
