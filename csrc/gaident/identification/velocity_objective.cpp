#include "velocity_objective.hpp"

#include "../target/mirror.hpp"
#include "chromosomes.hpp"
#include "neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace gaident {

namespace {

// Power of white noise on a smooth signal, from its third differences (median, so robust), whose variance is 1 + 9 + 9 + 1 = 20
// times the noise's.
// Of a long record an evenly spaced part will do.
double noise_power(std::span<const double> w) {
    const std::size_t stride = std::max<std::size_t>(1, w.size() / noise_samples);
    std::vector<double> sizes;
    for (std::size_t n = 3; n < w.size(); n += stride)
        sizes.push_back(std::abs(w[n] - 3.0 * w[n - 1] + 3.0 * w[n - 2] - w[n - 3]));
    if (sizes.empty()) return 0.0;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return 1.4826 * 1.4826 * *middle * *middle / 20.0;
}

RefineOptions options(const SearchRanges& ranges, std::size_t samples) {
    RefineOptions o;
    o.ranges = ranges;
    o.tolerance = 0.01 / static_cast<double>(samples);  // of a unit of BIC: N ln J
    return o;
}

class BatchEvaluator final : public Evaluator {
public:
    BatchEvaluator(const Experiment& experiment, const Genome& genome, const PlantCoding& coding, std::size_t capacity)
        : decoder_(genome), weights_(coding.weights), batch_(experiment, capacity, coding.in_float) {}

    void evaluate(const Population& all, std::span<double> costs) override {
        batch_.errors(Chromosomes(all, decoder_), costs);
        for (std::size_t i = 0; i < all.size(); ++i) costs[i] = fitness(costs[i], decoder_.structure(all[i]), weights_);
    }

private:
    Decoder decoder_;
    FitnessWeights weights_;
    Batch batch_;
};

class MirrorEvaluator final : public Evaluator {
public:
    explicit MirrorEvaluator(std::unique_ptr<Mirror> mirror) : mirror_(std::move(mirror)) {}
    void evaluate(const Population& all, std::span<double> costs) override { mirror_->evaluate(all, costs); }
    std::size_t overflows() const override { return mirror_->overflows(); }

private:
    std::unique_ptr<Mirror> mirror_;
};

// The best candidates, no two of them from the same place on the grid (grow() lists one place after the other).
std::vector<std::size_t> lowest_apart(const std::vector<double>& costs, std::size_t count) {
    const std::size_t place = std::max<std::size_t>(1, costs.size() / grid_points);
    std::vector<std::size_t> order(costs.size()), chosen;
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t x, std::size_t y) { return costs[x] < costs[y] || (costs[x] == costs[y] && x < y); });
    for (const std::size_t at : order) {
        const bool apart = std::none_of(chosen.begin(), chosen.end(), [&](std::size_t c) { return c / place == at / place; });
        if (apart) chosen.push_back(at);
        if (chosen.size() == count) break;
    }
    return chosen;
}

}  // namespace

std::vector<Structure> structures(const SearchRanges& r) {
    std::vector<Structure> all;
    for (int n = r.p_min + r.q_min; n <= r.p_max + r.q_max; ++n)
        for (int q = std::max(r.q_min, n - r.p_max); q <= std::min(r.q_max, n - r.p_min); ++q) all.push_back({n - q, q});
    return all;
}

SearchRanges with_smaller(SearchRanges r) {
    r.p_min = std::min(r.p_min, 1);
    r.q_min = 0;
    return r;
}

VelocityObjective::VelocityObjective(const Experiment& experiment, const SearchRanges& ranges, const PlantCoding& coding,
                                     Smaller smaller)
    : experiment_(experiment),
      coding_(coding),
      genome_(smaller == Smaller::searched ? with_smaller(ranges) : ranges, coding.code, coding.roots),
      structures_(structures(genome_.ranges())),
      refiner_(experiment, options(ranges, experiment.samples())) {
    for (const Structure s : structures_) species_.push_back({s.poles(), s.p >= ranges.p_min && s.q >= ranges.q_min});
    for (const Record& r : experiment.records) {
        slowest_ = std::min(slowest_, 0.5 / (static_cast<double>(r.size()) * r.sample_time));
        fastest_ = std::max(fastest_, 3.0 / r.sample_time);
        noise_ += noise_power(r.output) * static_cast<double>(r.size());
    }
    for (const Response* r : experiment.responses) {
        slowest_ = std::min(slowest_, 0.08 * r->slowest());  // as of a record that is as long as its slowest period
        fastest_ = std::max(fastest_, r->fastest());
        noise_ += r->noise();
    }
}

std::unique_ptr<Evaluator> VelocityObjective::evaluator(std::size_t capacity) const {
    if (coding_.mirror.empty()) return std::make_unique<BatchEvaluator>(experiment_, genome_, coding_, capacity);
    return std::make_unique<MirrorEvaluator>(make_mirror(coding_.mirror, experiment_, genome_, coding_.weights));
}

bool VelocityObjective::leads_to(std::size_t small, std::size_t large) const {
    return may_grow(structures_[small], structures_[large]);
}

Factors<double> VelocityObjective::factors(const Word* c) const { return decode(c, genome_); }

Refined VelocityObjective::at_rest_or_steady(const Factors<double>& g) const {
    Refined start;
    start.factors = g;
    start.starts = Unknowns(experiment_, g.structure).steady_starts(experiment_, g);
    return start;
}

std::vector<Refined> VelocityObjective::enlarged(const Refined& from, std::size_t to, std::size_t count) const {
    const std::vector<Factors<double>> grown = grow(from.factors, structures_[to], genome_.ranges(), slowest_, fastest_);
    std::vector<Refined> starts;
    for (const std::size_t i : lowest_apart(refiner_.costs(grown), count)) starts.push_back(at_rest_or_steady(grown[i]));
    return starts;
}

Refined VelocityObjective::reduced(const Refined& from, std::size_t to) const {
    const std::vector<Factors<double>> made = shrink(from.factors, structures_[to]);
    if (made.empty()) return {};
    const std::vector<double> costs = refiner_.costs(made);
    const auto least = std::min_element(costs.begin(), costs.end());
    Refined start = at_rest_or_steady(made[static_cast<std::size_t>(least - costs.begin())]);
    start.cost = *least;
    return start;
}

}  // namespace gaident
