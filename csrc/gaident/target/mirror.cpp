#include "mirror.hpp"

#include "../numeric/c30.hpp"
#include "../numeric/denormals.hpp"
#include "fixed_scaling.hpp"
#include "../simulation/simulate.hpp"

#include <algorithm>
#include <limits>
#include <string>

namespace gaident {

namespace {

double peak_of(const Experiment& e) {
    double peak = 0.0;
    for (const Record& r : e.records)
        for (std::size_t i = 0; i < r.size(); ++i) peak = std::max({peak, std::abs(r.input[i]), std::abs(r.output[i])});
    return peak;
}

template <class A>
class MirrorOf final : public Mirror {
public:
    using Number = typename A::Number;

    MirrorOf(const Experiment& experiment, const Genome& genome, const FitnessWeights& weights)
        : experiment_(experiment), genome_(genome), weights_(weights), peak_(peak_of(experiment)) {
        values_.gain = table(gain_, genome.field(Role::gain, Part::whole, 0));
        values_.real = table(real_, genome.field(Role::pole1, Part::real, 0));
        values_.imaginary = table(imaginary_, genome.field(Role::pole1, Part::imaginary, 0));
        for (int p = 0; p <= Genome::max_order; ++p) values_.unit[p] = static_cast<Number>(genome.ranges().gain_unit(p));
        for (const Record& r : experiment.records) taken_.emplace_back(r, experiment.loop, genome.ranges(), peak_);
    }

    void evaluate(const Population& all, std::span<double> costs) override {
        for (std::size_t i = 0; i < all.size(); ++i) {
            const Number cost = fitness(decode<A>(all[i], genome_, values_), all[i]);
            if (!(cost < A::worst())) ++overflows_;
            costs[i] = cost < A::worst() ? static_cast<double>(cost) : worst_fitness;
            experiment_.stop_if_asked();
        }
    }

private:
    // A record in the arithmetic.
    struct Taken {
        typename A::Scaling scaling;
        std::vector<typename A::Sample> input, output;
        bool settles;

        Taken(const Record& r, const Loop& loop, const SearchRanges& ranges, double peak)
            : scaling(Extent{peak, r.size(), &ranges, loop.controller, Clock{r.sample_time}}) {
            settles = std::all_of(r.input.begin(), r.input.end(), [&](double v) { return v == r.input[0]; });
            for (const double v : r.input) input.push_back(A::sample(v, scaling));
            for (const double v : r.output) output.push_back(A::sample(v, scaling));
            if (!settles) return;
            for (auto& y : output) y = A::store(A::signal(y, scaling) - A::signal(input[0], scaling));
        }
        RecordView<A> view() const { return {input.data(), output.data(), output.size(), settles}; }
    };

    const Number* table(std::vector<Number>& values, const Field& f) const {
        for (std::uint32_t bits = 0; bits < 1U << f.width; ++bits)
            values.push_back(static_cast<Number>(genome_.value_of(bits, f)));
        return values.data();
    }

    Number fitness(const Factors<Number>& factors, const Word* c) const {
        const Loop& loop = experiment_.loop;
        Number error{};
        for (std::size_t r = 0; r < taken_.size(); ++r) {
            const Record& record = experiment_.records[r];
            const Delta<Number> h =
                close_loop(bilinear_plant(factors, record.sample_time), loop.controller, Clock{record.sample_time});
            typename A::State x[max_loop_order];
            double start[max_loop_order] = {};
            if (record.start != Start::rest) {
                const Prepared c0 = prepare(decode(c, genome_), record, loop, nullptr);
                std::copy(c0.x, c0.x + c0.response.order, start);
            }
            begin<A>(h, factors.structure, taken_[r].view(), taken_[r].scaling, x, start);
            const Number more = A::error(squared_errors<A>(h, x, taken_[r].view(), taken_[r].scaling));
            if (!(more < A::worst())) return A::worst();
            error = r == 0 ? more : Number(error + more);
        }
        return weights_.fitness(error, factors.structure);
    }

    const Experiment& experiment_;
    const Genome& genome_;
    Weights<A> weights_;
    double peak_;
    GeneValues<Number> values_;
    std::vector<Number> gain_, real_, imaginary_;
    std::vector<Taken> taken_;
};

// alpha and beta of equation (7) and the past they act on, newest first.
template <class A>
struct PowersOfZ {
    int order;
    typename A::Number alpha[max_loop_order + 1], beta[max_loop_order];
    typename A::Sample r[max_loop_order + 1] = {}, w[max_loop_order + 1] = {};

    explicit PowersOfZ(const Delta<double>& h) : order(h.order) {
        double a[max_loop_order + 1], b[max_loop_order];
        powers_of_z(h, a, b);
        for (int i = 0; i <= order; ++i) alpha[i] = static_cast<typename A::Number>(a[i]);
        for (int i = 0; i < order; ++i) beta[i] = static_cast<typename A::Number>(b[i]);
    }
    typename A::Signal step(const typename A::Sample& now, const typename A::Scaling& scaling) {
        std::copy_backward(r, r + order, r + order + 1);
        r[0] = now;
        auto sum = A::state(scaling, {}, 0) + alpha[0] * A::signal(r[0], scaling);
        for (int i = 1; i <= order; ++i) sum = sum + alpha[i] * A::signal(r[i], scaling);
        for (int i = 0; i < order; ++i) sum = sum + beta[i] * A::signal(w[i], scaling);
        const typename A::Signal y = sum;
        if (order > 0) std::copy_backward(w, w + order - 1, w + order);
        w[0] = A::store(y);
        return y;
    }
};

template <class Signal>
bool left_range(const Signal& y, double limit) {
    if constexpr (requires { y.saturated; }) return y.saturated;
    else return !(std::abs(static_cast<double>(y)) < limit);
}

template <class Number>
Factors<Number> taken_over(const Factors<double>& g) {
    const auto number = [](double x) { return static_cast<Number>(x); };
    Factors<Number> f;
    f.structure = g.structure;
    f.gain = number(g.gain);
    for (int i = 0; i < max_pairs; ++i) f.pole_pair[i] = {number(g.pole_pair[i].e1), number(g.pole_pair[i].e0)};
    for (int i = 0; i < max_pairs; ++i) f.zero_pair[i] = {number(g.zero_pair[i].e1), number(g.zero_pair[i].e0)};
    f.pole = number(g.pole);
    f.zero = number(g.zero);
    return f;
}

// Ranges that end at this model: its fastest root and its gain.
SearchRanges ranges_around(const Factors<double>& g) {
    const double root = std::max(largest_root(g), 1e-3), gain = std::max(std::abs(g.gain), 1e-300);
    SearchRanges r;
    r.gain = {0.5 * gain, gain};
    r.real = {0.0, 0.5 * root};
    r.imaginary = {0.0, root};
    r.p_min = r.p_max = g.structure.p;
    r.q_min = r.q_max = g.structure.q;
    return r;
}

template <class A>
bool velocity_in(bool in_z, const Factors<double>& g, std::span<const double> input, double Ts, const Loop& loop,
                 std::span<double> velocity, const std::atomic<bool>* stop) {
    using Number = typename A::Number;
    double peak = 0.0;
    for (const double v : input) peak = std::max(peak, std::abs(v));
    const SearchRanges ranges = ranges_around(g);
    const typename A::Scaling scaling(Extent{peak, input.size(), &ranges, loop.controller, Clock{Ts}});
    const double limit = static_cast<double>(A::worst());
    bool left = false;
    const auto keep = [&](std::size_t k, const typename A::Signal& y) {
        if (k % samples_between_stops == 0) stop_if_asked(stop);
        left = left || left_range(y, limit);
        velocity[k] = left ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(y);
    };
    if (in_z) {
        PowersOfZ<A> z(close_loop(bilinear_plant(g, Ts), loop.controller, Clock{Ts}));
        for (std::size_t k = 0; k < input.size(); ++k) keep(k, z.step(A::sample(input[k], scaling), scaling));
        return left;
    }
    std::vector<typename A::Sample> in, out;
    for (const double v : input) in.push_back(A::sample(v, scaling));
    out = in;
    const Delta<Number> h = close_loop(bilinear_plant(taken_over<Number>(g), Ts), loop.controller, Clock{Ts});
    typename A::State x[max_loop_order];
    begin<A>(h, g.structure, {in.data(), out.data(), in.size(), false}, scaling, x);
    std::size_t k = 0;
    squared_errors<A, -1, true>(h, x, in.data(), out.data(), in.size(), scaling,
                                [&](const typename A::Signal& y) { keep(k++, y); });
    for (int i = 0; i < h.order; ++i) left = left || left_range(typename A::Signal(x[i]), limit);
    return left;
}

template <class A>
std::unique_ptr<Mirror> mirror_of(const Experiment& e, const Genome& g, const FitnessWeights& w) {
    return std::make_unique<MirrorOf<A>>(e, g, w);
}

struct Row {
    std::string_view name;
    std::unique_ptr<Mirror> (*make)(const Experiment&, const Genome&, const FitnessWeights&);
    bool (*velocity)(bool, const Factors<double>&, std::span<const double>, double, const Loop&, std::span<double>,
                     const std::atomic<bool>*);
};

template <class A>
constexpr Row row(std::string_view name) {
    return {name, mirror_of<A>, velocity_in<A>};
}

// THE instantiations.
constexpr Row rows[] = {
    row<Plain<double>>("drive_double"), row<Plain<float>>("drive_float"),  row<Plain<C30Word, C30>>("c30"),
    row<FixedPoint<2>>("fixed"),        row<FixedPoint<0>>("fixed_tight"), row<FixedPoint<6>>("fixed_wide"),
};

const Row& row_named(std::string_view name, const Loop& loop) {
    for (const Row& r : rows) {
        if (r.name != name) continue;
        if (loop.kind != LoopKind::continuous || loop.limited())
            throw std::invalid_argument("arithmetic '" + std::string(name) +
                                        "' mirrors the paper's drive, whose loop is continuous and has no limits; use 'double'");
        return r;
    }
    throw std::invalid_argument("arithmetic '" + std::string(name) + "' is none that a drive has");
}

}  // namespace

std::unique_ptr<Mirror> make_mirror(std::string_view arithmetic, const Experiment& experiment, const Genome& genome,
                                    const FitnessWeights& weights) {
    return row_named(arithmetic, experiment.loop).make(experiment, genome, weights);
}

std::vector<std::string_view> mirror_names() {
    std::vector<std::string_view> names;
    for (const Row& r : rows) names.push_back(r.name);
    return names;
}

bool mirror_velocity(std::string_view arithmetic, bool in_z, const Factors<double>& g, std::span<const double> input,
                     double sample_time, const Loop& loop, std::span<double> velocity, const std::atomic<bool>* stop) {
    const FlushDenormals flush;
    return row_named(arithmetic, loop).velocity(in_z, g, input, sample_time, loop, velocity, stop);
}

}  // namespace gaident
