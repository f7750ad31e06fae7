#include "batch.hpp"

#include "advance.hpp"

#include <algorithm>
#include <numeric>

namespace gaident {

void Experiment::check() const {
    if (records.empty()) throw std::invalid_argument("records: at least one is needed");
    for (const Record& r : records) {
        if (r.size() == 0 || r.input.size() != r.output.size())
            throw std::invalid_argument("records: input and output must have the same length, at least 1");
        if (!(r.sample_time > 0.0)) throw std::invalid_argument("records: sample_time must be positive");
    }
}

std::size_t Experiment::samples() const {
    std::size_t n = 0;
    for (const Record& r : records) n += r.size();
    return n;
}

void steady_start(const Delta<double>& plant, const Record& record, const Loop& loop, double* start) {
    const double b = plant.order > 0 ? plant.b[plant.order] : 0.0;
    const double torque = b != 0.0 ? record.velocity0 * plant.a[plant.order - 1] / b : 0.0;
    steady_state(plant, record.velocity0, torque, start);
    if (loop.kind != LoopKind::open) start[plant.order] = torque;
}

Delta<double> plant_of(const Factors<double>& g, const Loop& loop, double sample_time) {
    if (loop.kind == LoopKind::continuous) return bilinear_plant(g, sample_time);
    return held_plant(g, sample_time, held_doublings(largest_root(g), sample_time));
}

Prepared prepare(const Factors<double>& g, const Record& record, const Loop& loop, const double* start) {
    const double Ts = record.sample_time;
    const bool closed = loop.kind != LoopKind::open;
    const Delta<double> plant = plant_of(g, loop, Ts);

    double x[max_loop_order + 1] = {};
    if (start != nullptr) std::copy(start, start + start_states(g.structure, loop), x);
    else if (record.start != Start::rest) steady_start(plant, record, loop, x);
    const double s = closed ? x[plant.order] : 0.0;

    Prepared c;
    c.s = s;
    if (!closed || loop.limited()) {
        c.response = plant;
        std::copy(x, x + plant.order, c.x);
    } else {
        c.response = close_loop(plant, loop.kp, loop.ki, Ts);
        loop_state(plant, loop.kp, loop.ki, Ts, x, s, c.x);
    }
    return c;
}

namespace {

void place(FactorGroup& group, std::size_t lane, const Factors<double>& g) {
    const Structure s = g.structure;
    const Counts& most = group.counts;
    group.gain[lane] = g.gain;
    for (int i = 0; i < most.pole_pairs; ++i) {
        const Pair<double> f = i < s.pole_pairs() ? g.pole_pair[i] : Pair<double>{0.0, 0.0};
        group.pole_e1[i][lane] = f.e1;
        group.pole_e0[i][lane] = f.e0;
    }
    for (int i = 0; i < most.zero_pairs; ++i) {
        const Pair<double> f = i < s.zero_pairs() ? g.zero_pair[i] : Pair<double>{0.0, 0.0};
        group.zero_e1[i][lane] = f.e1;
        group.zero_e0[i][lane] = f.e0;
    }
    group.pole[lane] = s.single_pole() ? g.pole : 0.0;
    group.zero[lane] = s.single_zero() ? g.zero : 0.0;
    for (int i = 0; i < most.p; ++i) group.excess[i][lane] = i < s.p ? 1.0 : 0.0;
}

}  // namespace

void load_group(const Experiment& experiment, const Record& record, std::span<const Factors<double>* const> candidates,
                std::span<const double* const> starts, DoubleGroup& group) {
    const Loop& loop = experiment.loop;
    const bool closed = loop.kind != LoopKind::open && !loop.limited();
    FactorGroup factors;
    factors.structure = candidates[0]->structure;
    double fastest = 0.0;
    for (const Factors<double>* g : candidates) {
        const Counts c = g->counts();
        Counts& most = factors.counts;
        most = {std::max(most.order, c.order),           std::max(most.p, c.p),
                std::max(most.pole_pairs, c.pole_pairs), std::max(most.zero_pairs, c.zero_pairs),
                most.single_pole || c.single_pole,       most.single_zero || c.single_zero};
        if (loop.kind != LoopKind::continuous) fastest = std::max(fastest, largest_root(*g));
    }
    if (loop.kind != LoopKind::continuous) factors.doublings = held_doublings(fastest, record.sample_time);
    for (std::size_t lane = 0; lane < FactorGroup::width; ++lane)
        place(factors, lane, *candidates[std::min(lane, candidates.size() - 1)]);
    experiment.kernels->coefficients(factors, loop, record.sample_time, closed, group);

    for (std::size_t lane = 0; lane < FactorGroup::width; ++lane) {
        const std::size_t i = std::min(lane, candidates.size() - 1);
        const double* const start = starts.empty() ? nullptr : starts[i];
        for (int k = 0; k < group.order; ++k) group.x[k][lane] = 0.0;
        group.s[lane] = 0.0;
        if (start == nullptr && record.start == Start::rest) continue;
        const Prepared c = prepare(*candidates[i], record, loop, start);
        for (int k = 0; k < c.response.order; ++k) group.x[k][lane] = c.x[k];
        group.s[lane] = c.s;
    }
}

Batch::Batch(const Experiment& experiment, std::size_t capacity, bool in_float)
    : experiment_(experiment), in_float_(in_float && !experiment.loop.limited()), order_(capacity), sorted_(capacity) {
    if (!in_float_) return;
    inputs_.reserve(experiment.samples());
    outputs_.reserve(experiment.samples());
    for (const Record& r : experiment.records) {
        for (double v : r.input) inputs_.push_back(static_cast<float>(v));
        for (double v : r.output) outputs_.push_back(static_cast<float>(v));
    }
}

// Behind a hold a group ends where the structure changes.
std::size_t Batch::group_end(std::size_t first, std::size_t count) const {
    std::size_t end = std::min<std::size_t>(first + DoubleGroup::width, count);
    if (experiment_.loop.kind == LoopKind::continuous) return end;
    for (std::size_t i = first + 1; i < end; ++i)
        if (!(sorted_[i]->structure == sorted_[first]->structure)) end = i;
    return end;
}

namespace {

void narrow(const DoubleGroup& from, int offset, FloatGroup& to) {
    for (int k = 0; k <= to.order; ++k)
        for (int lane = 0; lane < DoubleGroup::width; ++lane) {
            if (k < to.order) to.a[k][offset + lane] = k < from.order ? static_cast<float>(from.a[k][lane]) : 0.0F;
            if (k < to.order) to.x[k][offset + lane] = k < from.order ? static_cast<float>(from.x[k][lane]) : 0.0F;
            to.b[k][offset + lane] = k <= from.order ? static_cast<float>(from.b[k][lane]) : 0.0F;
        }
    for (int lane = 0; lane < DoubleGroup::width; ++lane) to.s[offset + lane] = static_cast<float>(from.s[lane]);
}

}  // namespace

// Advances a group over a record, chunk by chunk; adds each lane's squared errors.
template <class G, class T, class Errors>
void Batch::advance(Errors&& errors, G& group, std::span<const T> in, std::span<const T> out, double* sums) const {
    for (std::size_t i = 0; i < in.size(); i += chunk_samples) {
        const std::size_t n = std::min(chunk_samples, in.size() - i);
        T part[G::width];
        errors(group, in.data() + i, out.data() + i, n, part);
        for (std::size_t lane = 0; lane < G::width; ++lane) sums[lane] += static_cast<double>(part[lane]);
        experiment_.stop_if_asked();
    }
}

void Batch::advance_double(DoubleGroup& group, const Record& record, double* sums) const {
    const Controller<double> controller(experiment_.loop, record.sample_time);
    const auto errors = [&](DoubleGroup& g, const double* in, const double* out, std::size_t n, double* part) {
        advance_errors(*experiment_.kernels, experiment_.loop, controller, g, in, out, n, part);
    };
    advance(errors, group, record.input, record.output, sums);
}

// The next candidates from `first` on that share a group; returns the first that does not.
std::size_t Batch::load(const Record& record, std::size_t first, std::size_t count, DoubleGroup& group) const {
    const std::size_t end = group_end(first, count);
    load_group(experiment_, record, std::span(sorted_).subspan(first, end - first), {}, group);
    return end;
}

void Batch::run_double(const Record& record, std::size_t count, double* sums) {
    for (std::size_t first = 0; first < count;) {
        const std::size_t end = load(record, first, count, halves_[0]);
        double part[DoubleGroup::width] = {};
        advance_double(halves_[0], record, part);
        for (std::size_t i = first; i < end; ++i) sums[order_[i]] += part[i - first];
        first = end;
    }
}

// Two groups of eight side by side; a lane that 24 bits cannot hold takes its sum from a run of its eight in double.
void Batch::run_float(const Record& record, std::span<const float> in, std::span<const float> out, std::size_t count,
                      double* sums) {
    for (std::size_t first = 0; first < count;) {
        const std::size_t middle = load(record, first, count, halves_[0]);
        const std::size_t end = middle < count ? load(record, middle, count, halves_[1]) : middle;
        if (middle == count) halves_[1] = halves_[0];
        float_group_.order = std::max(halves_[0].order, halves_[1].order);
        narrow(halves_[0], 0, float_group_);
        narrow(halves_[1], DoubleGroup::width, float_group_);
        double part[FloatGroup::width] = {};
        advance(experiment_.kernels->in_float.errors, float_group_, in, out, part);

        const std::size_t starts[] = {first, middle, end};
        for (std::size_t h = 0; h < 2; ++h) {
            DoubleGroup& half = halves_[h];
            const std::size_t used = starts[h + 1] - starts[h];
            const auto suffices = [&](std::size_t lane) {
                return float_suffices(half.order, [&](int i) { return half.a[i][lane]; });
            };
            bool in_float[DoubleGroup::width], all = true;
            for (std::size_t lane = 0; lane < used; ++lane) all = (in_float[lane] = suffices(lane)) && all;
            double exact[DoubleGroup::width] = {};
            if (!all) advance_double(half, record, exact);
            for (std::size_t lane = 0; lane < used; ++lane)
                sums[order_[starts[h] + lane]] += in_float[lane] ? part[h * DoubleGroup::width + lane] : exact[lane];
        }
        first = end;
    }
}

void Batch::errors(std::span<const Factors<double>> candidates, std::span<double> sums) {
    const std::size_t count = candidates.size();
    // Candidates of one order share their lanes: sorting by order keeps the sum of group orders small; within an order by q, so that
    // structures stay together.
    constexpr std::size_t keys = (max_plant_order + 1) * (max_plant_order / 2 + 1);
    std::size_t at[keys + 1] = {};
    const auto key = [](Structure s) { return static_cast<std::size_t>(s.poles() * (max_plant_order / 2 + 1) + s.q); };
    for (const auto& g : candidates) ++at[key(g.structure) + 1];
    for (std::size_t i = 1; i <= keys; ++i) at[i] += at[i - 1];
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t place = at[key(candidates[i].structure)]++;
        order_[place] = i;
        sorted_[place] = &candidates[i];
    }

    std::fill(sums.begin(), sums.begin() + static_cast<std::ptrdiff_t>(count), 0.0);
    std::size_t offset = 0;
    for (const Record& record : experiment_.records) {
        if (in_float_) {
            const std::span<const float> in(inputs_.data() + offset, record.size());
            const std::span<const float> out(outputs_.data() + offset, record.size());
            run_float(record, in, out, count, sums.data());
        } else {
            run_double(record, count, sums.data());
        }
        offset += record.size();
    }
    for (std::size_t i = 0; i < count; ++i) sums[i] = sane(sums[i]);
}

}  // namespace gaident
