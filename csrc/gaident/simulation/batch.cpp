#include "batch.hpp"

#include "advance.hpp"
#include "../control/servo_equation.hpp"
#include "../runtime/parallel.hpp"

#include <algorithm>
#include <numeric>

namespace gaident {

void Experiment::check() const {
    if (records.empty() && responses.empty()) throw std::invalid_argument("records: at least one is needed");
    for (const Record& r : records) {
        if (r.size() == 0 || r.input.size() != r.output.size())
            throw std::invalid_argument("records: input and output must have the same length, at least 1");
        if (!(r.sample_time > 0.0)) throw std::invalid_argument("records: sample_time must be positive");
        if ((loop.kind == LoopKind::servo) != (r.servo != nullptr))
            throw std::invalid_argument("records: the equation of the loop belongs to a servo loop, and to every record in it");
        if (loop.kind == LoopKind::servo && r.start != Start::rest)
            throw std::invalid_argument("records: a record in a servo loop must start at rest");
        if (!r.straight.empty() && r.straight.size() != r.size())
            throw std::invalid_argument("records: input and its straight part must have the same length");
    }
}

std::size_t Experiment::samples() const {
    std::size_t n = 0;
    for (const Record& r : records) n += r.size();
    for (const Response* r : responses) n += r->numbers();
    return n;
}

void Experiment::share_among_workers(std::size_t n, const std::function<void(std::size_t)>& work) const {
    workers->share(n, work);
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
        c.response = close_loop(plant, loop.controller, Clock{Ts});
        loop_state(plant, loop.controller, Clock{Ts}, x, s, c.x);
    }
    return c;
}

namespace {

// Candidates at hand as factors.
class FactorList final : public Candidates {
public:
    explicit FactorList(std::span<const Factors<double>* const> all) : all_(all) {}

    std::size_t size() const override { return all_.size(); }
    void structures(Structure* all) const override {
        for (std::size_t i = 0; i < all_.size(); ++i) all[i] = all_[i]->structure;
    }
    Factors<double> factors(std::size_t i) const override { return *all_[i]; }
    void place(const std::size_t* index, const Structure*, std::size_t, FactorGroup& group) const override {
        for (std::size_t lane = 0; lane < FactorGroup::width; ++lane) place(*all_[index[lane]], group, lane);
    }

private:
    static void place(const Factors<double>& g, FactorGroup& group, std::size_t lane) {
        const Structure s = g.structure;
        const Counts& most = group.counts;
        group.gain[lane] = g.gain;
        for (int k = 0; k < most.pole_pairs; ++k) {
            const Pair<double> f = k < s.pole_pairs() ? g.pole_pair[k] : Pair<double>{0.0, 0.0};
            group.pole_e1[k][lane] = f.e1;
            group.pole_e0[k][lane] = f.e0;
        }
        for (int k = 0; k < most.zero_pairs; ++k) {
            const Pair<double> f = k < s.zero_pairs() ? g.zero_pair[k] : Pair<double>{0.0, 0.0};
            group.zero_e1[k][lane] = f.e1;
            group.zero_e0[k][lane] = f.e0;
        }
        group.pole[lane] = s.single_pole() ? g.pole : 0.0;
        group.zero[lane] = s.single_zero() ? g.zero : 0.0;
        for (int k = 0; k < most.p; ++k) group.excess[k][lane] = k < s.p ? 1.0 : 0.0;
    }

    std::span<const Factors<double>* const> all_;
};

// largest_root() of the lane where it is largest.
double largest_root(const FactorGroup& g) {
    double direct = 0.0, square = 0.0;
    const auto take = [](double& most, const double* row) {
        for (int lane = 0; lane < FactorGroup::width; ++lane) most = std::max(most, std::abs(row[lane]));
    };
    for (int i = 0; i < g.counts.pole_pairs; ++i) take(direct, g.pole_e1[i]), take(square, g.pole_e0[i]);
    for (int i = 0; i < g.counts.zero_pairs; ++i) take(direct, g.zero_e1[i]), take(square, g.zero_e0[i]);
    take(direct, g.pole);
    take(direct, g.zero);
    return std::max(direct, std::sqrt(square));
}

// Candidates index[0], index[1], ... index[count - 1], of structures s[0], s[1], ..., into the lanes of a group.
void load_lanes(const Experiment& experiment, const Record& record, const Candidates& candidates, const std::size_t* index,
                const Structure* s, std::size_t count, std::span<const double* const> starts, DoubleGroup& group) {
    const Loop& loop = experiment.loop;
    const bool closed = loop.kind != LoopKind::open && !loop.limited();
    FactorGroup factors;
    factors.structure = s[0];
    factors.counts = Counts(s[0]);
    for (std::size_t lane = 1; lane < count; ++lane)
        if (!(s[lane] == s[lane - 1])) factors.counts.cover(Counts(s[lane]));
    std::size_t of_lane[FactorGroup::width];
    for (std::size_t lane = 0; lane < FactorGroup::width; ++lane) of_lane[lane] = index[std::min(lane, count - 1)];
    candidates.place(of_lane, s, count, factors);
    if (record.servo != nullptr && record.servo->order(factors.counts.order) > max_loop_order)
        throw std::invalid_argument("loop: plant and controller have more than 15 states together");
    const double period = record.servo != nullptr ? record.servo->period() : record.sample_time;
    if (loop.kind != LoopKind::continuous) factors.doublings = held_doublings(largest_root(factors), period);
    if (record.servo != nullptr) experiment.kernels->servo_coefficients(factors, *record.servo, group);
    else experiment.kernels->coefficients(factors, loop, period, closed, group);

    for (int k = 0; k < group.order; ++k) std::fill(group.x[k], group.x[k] + DoubleGroup::width, 0.0);
    std::fill(group.s, group.s + DoubleGroup::width, 0.0);
    if (starts.empty() && record.start == Start::rest) return;
    for (std::size_t lane = 0; lane < DoubleGroup::width; ++lane) {
        const std::size_t i = std::min(lane, count - 1);
        const Prepared c = prepare(candidates.factors(index[i]), record, loop, starts.empty() ? nullptr : starts[i]);
        for (int k = 0; k < c.response.order; ++k) group.x[k][lane] = c.x[k];
        group.s[lane] = c.s;
    }
}

}  // namespace

void load_group(const Experiment& experiment, const Record& record, std::span<const Factors<double>* const> candidates,
                std::span<const double* const> starts, DoubleGroup& group) {
    std::size_t index[DoubleGroup::width];
    Structure s[DoubleGroup::width];
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        index[i] = i;
        s[i] = candidates[i]->structure;
    }
    load_lanes(experiment, record, FactorList(candidates), index, s, candidates.size(), starts, group);
}

namespace {

bool settles(const Record& r, const Loop& loop) {
    return loop.kind != LoopKind::open && !loop.limited() && (r.servo == nullptr || r.servo->rests_at_its_command()) &&
           std::all_of(r.input.begin(), r.input.end(), [&](double v) { return v == r.input[0]; });
}

}  // namespace

Batch::Batch(const Experiment& experiment, std::size_t capacity, bool in_float)
    : experiment_(experiment),
      in_float_(in_float && !experiment.loop.limited() && experiment.loop.kind != LoopKind::servo),
      order_(capacity),
      sorted_(capacity),
      keys_(capacity),
      list_(capacity) {
    std::size_t constant = 0;
    for (const Record& r : experiment.records) {
        settling_.push_back(settles(r, experiment.loop) ? 1 : 0);
        if (settling_.back() != 0) constant += r.size();
    }
    deviations_.reserve(constant);  // views point into it
    for (std::size_t i = 0; i < experiment.records.size(); ++i) {
        const Record& r = experiment.records[i];
        views_.push_back({r.input, r.output});
        if (settling_[i] == 0) continue;
        const std::size_t first = deviations_.size();
        for (const double y : r.output) deviations_.push_back(y - r.input[0]);
        views_.back().output = std::span(deviations_).subspan(first);
    }
    if (!in_float_) return;
    floats_.reserve(2 * experiment.samples());
    for (const View<double>& v : views_) {
        const std::size_t first = floats_.size(), n = v.output.size();
        for (const auto& signal : {v.input, v.output})
            for (const double x : signal) floats_.push_back(static_cast<float>(x));
        float_views_.push_back({std::span(floats_).subspan(first, n), std::span(floats_).subspan(first + n, n)});
    }
}

// Behind a hold a group ends where the structure changes.
std::size_t Batch::group_end(std::size_t first, std::size_t count) const {
    std::size_t end = std::min<std::size_t>(first + DoubleGroup::width, count);
    if (experiment_.loop.kind == LoopKind::continuous) return end;
    for (std::size_t i = first + 1; i < end; ++i)
        if (!(sorted_[i] == sorted_[first])) end = i;
    return end;
}

namespace {

constexpr std::size_t none = ~std::size_t{0};

// From states to their deviations from rest under the constant command r.
void settle(DoubleGroup& g, double r) {
    for (int i = 0; i < g.order; ++i)
        for (int lane = 0; lane < DoubleGroup::width; ++lane) {
            const auto a = [&](int k) { return g.a[k][lane]; };
            const auto b = [&](int k) { return g.b[k][lane]; };
            g.x[i][lane] -= at_rest(i, a, b) * r;
        }
}

void narrow(const DoubleGroup& from, int offset, FloatGroup& to) {
    for (int k = 0; k <= to.order; ++k)
        for (int lane = 0; lane < DoubleGroup::width; ++lane) {
            if (k < to.order) to.a[k][offset + lane] = k < from.order ? static_cast<float>(from.a[k][lane]) : 0.0F;
            if (k < to.order) to.x[k][offset + lane] = k < from.order ? static_cast<float>(from.x[k][lane]) : 0.0F;
            to.b[k][offset + lane] = k <= from.order ? static_cast<float>(from.b[k][lane]) : 0.0F;
        }
    for (int lane = 0; lane < DoubleGroup::width; ++lane) to.s[offset + lane] = static_cast<float>(from.s[lane]);
}

// Groups that a thread takes together: neighbours of one order, since the kernels run two or three registers side by side faster
// than one after the other, and no more than three.
template <class G>
std::vector<int> sets_of(const G* groups, int count) {
    std::vector<int> first{0};
    for (int g = 0; g < count; g = first.back()) {
        int same = 1;
        while (g + same < count && groups[g + same].order == groups[g].order) ++same;
        first.push_back(g + (same <= 3 ? same : 2));
    }
    return first;
}

}  // namespace

// Advances groups over a record; adds each lane's squared errors.
// Where that is long work, sets of groups are shared, a chunk of the record at a time: which thread takes which chunk changes
// nothing in what is computed.
template <class T, class G>
void Batch::advance(const View<T>& view, const Record& record, G* groups, int lanes, double* sums) const {
    constexpr std::size_t long_work = 1 << 18;  // samples of a candidate: near 0.1 ms
    const std::size_t samples = view.output.size();
    if (experiment_.workers == nullptr || static_cast<std::size_t>(lanes) * samples < long_work)
        return advance_part(view, record, groups, lanes, 0, samples, sums);
    const std::vector<int> first = sets_of(groups, (lanes + G::width - 1) / G::width);
    const std::size_t chunks = (samples + chunk_samples - 1) / chunk_samples;
    experiment_.workers->share_strands(first.size() - 1, chunks, [&](std::size_t set, std::size_t chunk) {
        const int lane = first[set] * G::width, own = std::min(lanes, first[set + 1] * G::width) - lane;
        const std::size_t from = chunk * chunk_samples;
        advance_part(view, record, groups + first[set], own, from, std::min(from + chunk_samples, samples), sums + lane);
    });
}

// Over samples [from, to), chunk by chunk.
template <class T, class G>
void Batch::advance_part(const View<T>& view, const Record& record, G* groups, int lanes, std::size_t from, std::size_t to,
                         double* sums) const {
    const bool settling = settling_[static_cast<std::size_t>(&record - experiment_.records.data())] != 0;
    const ControllerState<double> controller(experiment_.loop.controller, Clock{record.sample_time});
    for (std::size_t i = from; i < to; i += chunk_samples) {
        const std::size_t n = std::min(chunk_samples, to - i);
        const T *const in = view.input.data() + i, *const out = view.output.data() + i;
        T part[static_cast<std::size_t>(bank_groups) * DoubleGroup::width];
        const auto run = [&](const auto& kernels) {
            if (settling) kernels.settling_errors(groups, lanes, out, n, part);
            else kernels.many_errors(groups, lanes, in, out, n, part);
        };
        if constexpr (std::same_as<T, float>) {
            run(experiment_.kernels->in_float);
        } else if (!record.straight.empty()) {
            experiment_.kernels->in_double.both_errors(groups, lanes, in, record.straight.data() + i, out, n, part);
        } else if (experiment_.loop.limited()) {
            for (int g = 0; g * G::width < lanes; ++g)
                experiment_.kernels->in_double.stepped_errors(groups[g], controller, in, out, n, part + g * G::width);
        } else {
            run(experiment_.kernels->in_double);
        }
        for (int lane = 0; lane < lanes; ++lane) sums[lane] += static_cast<double>(part[lane]);
        experiment_.stop_if_asked();
    }
}

void Batch::run(std::size_t r, const Candidates& candidates, double* sums) {
    const std::size_t count = candidates.size();
    constexpr std::size_t W = DoubleGroup::width;
    const Record& record = experiment_.records[r];
    for (std::size_t first = 0; first < count;) {
        // Which candidate sits in which lane of the bank; behind a hold a group can end early and leave lanes empty.
        std::size_t candidate[bank_groups * W], lanes = 0;
        for (int g = 0; g < bank_groups && first < count; ++g) {
            const std::size_t end = group_end(first, count);
            load_lanes(experiment_, record, candidates, order_.data() + first, sorted_.data() + first, end - first, {}, bank_[g]);
            if (settling_[r] != 0) settle(bank_[g], record.input[0]);
            lanes = static_cast<std::size_t>(g) * W;
            for (std::size_t lane = 0; lane < W; ++lane)
                candidate[lanes + lane] = lane < end - first ? order_[first + lane] : none;
            lanes += end - first;
            first = end;
        }
        double part[bank_groups * W] = {};
        if (!in_float_) {
            advance(views_[r], record, bank_, static_cast<int>(lanes), part);
        } else {
            // Two groups side by side; a group with a lane that 24 bits cannot represent is run in double as well, for that lane.
            const std::size_t groups = (lanes + W - 1) / W;
            for (std::size_t g = 0; g < groups; g += 2) {
                const DoubleGroup& second = bank_[g + 1 < groups ? g + 1 : g];
                float_bank_[g / 2].order = std::max(bank_[g].order, second.order);
                narrow(bank_[g], 0, float_bank_[g / 2]);
                narrow(second, W, float_bank_[g / 2]);
            }
            advance(float_views_[r], record, float_bank_, static_cast<int>(lanes), part);
            for (std::size_t g = 0; g < groups; ++g) {
                bool in_float[W], all = true;
                for (std::size_t lane = 0; lane < W; ++lane)
                    all = (in_float[lane] = float_suffices(bank_[g].order, [&](int i) { return bank_[g].a[i][lane]; })) && all;
                if (all) continue;
                double exact[W] = {};
                advance(views_[r], record, bank_ + g, W, exact);
                for (std::size_t lane = 0; lane < W; ++lane)
                    if (!in_float[lane]) part[g * W + lane] = exact[lane];
            }
        }
        for (std::size_t lane = 0; lane < lanes; ++lane)
            if (candidate[lane] != none) sums[candidate[lane]] += part[lane];
    }
}

void Batch::errors(const Candidates& candidates, std::span<double> sums) {
    const std::size_t count = candidates.size();
    // Candidates of one order share their lanes: sorting by order keeps the sum of group orders small; within an order by q, so
    // that structures stay together.
    constexpr std::size_t most_q = max_plant_order / 2, keys = (max_plant_order + 1) * (most_q + 1);
    std::uint32_t at[keys + 1] = {};
    std::size_t largest = 0;
    candidates.structures(sorted_.data());
    for (std::size_t i = 0; i < count; ++i) {
        const Structure s = sorted_[i];
        const std::size_t key = static_cast<std::size_t>(s.poles()) * (most_q + 1) + static_cast<std::size_t>(s.q);
        keys_[i] = static_cast<std::uint8_t>(key);
        ++at[key + 1];
        largest = std::max(largest, key);
    }
    for (std::size_t k = 1; k <= largest; ++k) at[k] += at[k - 1];
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t place = at[keys_[i]]++;
        const int poles = keys_[i] / static_cast<int>(most_q + 1), q = keys_[i] % static_cast<int>(most_q + 1);
        order_[place] = i;
        sorted_[place] = {poles - q, q};
    }
    std::fill(sums.begin(), sums.begin() + static_cast<std::ptrdiff_t>(count), 0.0);
    for (std::size_t r = 0; r < experiment_.records.size(); ++r) run(r, candidates, sums.data());
    for (const Response* r : experiment_.responses)
        for (std::size_t i = 0; i < count; ++i) sums[i] += r->error_sum(candidates.factors(i));
    for (std::size_t i = 0; i < count; ++i) sums[i] = sane(sums[i]);
}

void Batch::errors(std::span<const Factors<double>> candidates, std::span<double> sums) {
    for (std::size_t i = 0; i < candidates.size(); ++i) list_[i] = &candidates[i];
    errors(FactorList(std::span(list_).first(candidates.size())), sums);
}

}  // namespace gaident
