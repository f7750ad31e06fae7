#include "batch.hpp"

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

Batch::Batch(const Experiment& experiment, std::size_t capacity, bool in_float)
    : experiment_(experiment), in_float_(in_float), order_(capacity), prepared_(capacity) {
    if (!in_float) return;
    inputs_.reserve(experiment.samples());
    outputs_.reserve(experiment.samples());
    for (const Record& r : experiment.records) {
        for (double v : r.input) inputs_.push_back(static_cast<float>(v));
        for (double v : r.output) outputs_.push_back(static_cast<float>(v));
    }
}

template <class G, class T>
void Batch::run(const KernelSet<G, T>& kernels, G& group, std::span<const T> in, std::span<const T> out, const Record& record,
                std::size_t count, double* sums) {
    const Controller<T> controller(experiment_.loop, record.sample_time);
    const bool stepped = experiment_.loop.limited();
    for (std::size_t first = 0; first < count; first += G::width) {
        const std::size_t used = std::min<std::size_t>(G::width, count - first);
        group.order = 0;
        for (std::size_t i = 0; i < used; ++i)
            group.order = std::max(group.order, prepared_[order_[first + i]].response.order);
        // Unused lanes repeat the last candidate.
        for (int lane = 0; lane < G::width; ++lane)
            place(group, lane, prepared_[order_[first + std::min<std::size_t>(static_cast<std::size_t>(lane), used - 1)]]);
        for (std::size_t i = 0; i < in.size(); i += chunk_samples) {
            const std::size_t n = std::min(chunk_samples, in.size() - i);
            T part[G::width];
            if (stepped) kernels.stepped_errors(group, controller, in.data() + i, out.data() + i, n, part);
            else kernels.errors(group, in.data() + i, out.data() + i, n, part);
            for (std::size_t k = 0; k < used; ++k) sums[order_[first + k]] += static_cast<double>(part[k]);
            experiment_.stop_if_asked();
        }
    }
}

void Batch::errors(std::span<const Factors<double>> candidates, std::span<double> sums) {
    const std::size_t count = candidates.size();
    // Candidates of one order share their lanes: a counting sort by order keeps the sum of group orders small.
    std::size_t at[max_plant_order + 2] = {};
    for (const auto& g : candidates) ++at[g.structure.poles() + 1];
    for (int i = 1; i < max_plant_order + 2; ++i) at[i] += at[i - 1];
    for (std::size_t i = 0; i < count; ++i) order_[at[candidates[i].structure.poles()]++] = i;

    std::fill(sums.begin(), sums.begin() + static_cast<std::ptrdiff_t>(count), 0.0);
    std::size_t offset = 0;
    for (const Record& record : experiment_.records) {
        for (std::size_t i = 0; i < count; ++i)
            prepared_[i] = prepare(candidates[i], record, experiment_.loop, nullptr);
        if (in_float_) {
            const std::span<const float> in(inputs_.data() + offset, record.size());
            const std::span<const float> out(outputs_.data() + offset, record.size());
            run(experiment_.kernels->in_float, float_group_, in, out, record, count, sums.data());
        } else {
            run(experiment_.kernels->in_double, double_group_, record.input, record.output, record, count, sums.data());
        }
        offset += record.size();
    }
    for (std::size_t i = 0; i < count; ++i) sums[i] = sane(sums[i]);
}

}  // namespace gaident
