#include "check.hpp"
#include "gaident/estimation/parameters.hpp"
#include "gaident/reference/drives.hpp"
#include "gaident/estimation/refine.hpp"
#include "gaident/simulation/simulate.hpp"

using namespace gaident;

namespace {

// Records of one drive, one per command, with the loop's experiment around them.
struct Bench {
    reference::Drive drive;
    std::vector<std::vector<double>> inputs, outputs;
    Experiment experiment;

    Bench(reference::Drive d, std::vector<std::vector<double>> commands, double noise = 0.0, std::uint64_t seed = 1)
        : drive(std::move(d)), inputs(std::move(commands)) {
        Random random(seed);
        experiment.loop = drive.loop;
        for (const auto& command : inputs) {
            drive.input = command;
            outputs.emplace_back();
            for (const long double w : drive.respond<long double>().velocity)
                outputs.back().push_back(static_cast<double>(w) + noise * reference::normal(random));
        }
        attach();
    }
    Bench(const Bench&) = delete;
    void attach() {
        experiment.records.resize(inputs.size());
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            experiment.records[i].input = inputs[i];
            experiment.records[i].output = outputs[i];
            experiment.records[i].sample_time = drive.sample_time;
        }
    }
    double scale() const {
        double sum = 0.0;
        for (const auto& y : outputs)
            for (const double w : y) sum += w * w;
        return sum;
    }
};

reference::Drive paper(LoopKind kind) {
    reference::Drive d = reference::paper_drive(true);
    d.loop.kind = kind;
    return d;
}

// Commands a drive test would use; in open loop a torque of a fitting size.
std::vector<double> command(LoopKind kind, std::size_t n, std::uint64_t seed) {
    Random random(seed);
    std::vector<double> r(n);
    double level = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
        if (i % 60 == 0) level = (kind == LoopKind::open ? 0.3 : 30.0) * reference::normal(random);
        r[i] = level;
    }
    return r;
}

RefineOptions wide() {
    RefineOptions o;
    o.ranges.gain = {100.0, 1e6};
    o.ranges.real = {-50.0, 500.0};
    o.ranges.imaginary = {0.0, 900.0};
    return o;
}

Factors<double> perturbed(const Factors<double>& g, Random& random, double by) {
    std::vector<double> x = pack(g, {});
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double change = by * (2.0 * random.uniform() - 1.0);
        x[i] = i == 0 ? x[i] + change : x[i] * (1.0 + change);
    }
    return unpack(x, g.structure);
}

// The referee's modules of a parameter vector, which may be in more digits than double.
template <class R>
reference::System<R> system_of(const std::vector<R>& x, R K, Structure s) {
    reference::System<R> system{K, {}};
    std::size_t k = 1, z = 1 + static_cast<std::size_t>(s.poles());
    int zero_pairs = s.zero_pairs();
    bool single_zero = s.single_zero();
    const R b = single_zero ? x[static_cast<std::size_t>(s.parameters()) - 1] : R(0);
    for (int i = 0; i < s.pole_pairs(); ++i, k += 2) {
        std::array<R, 3> n{R(0), R(0), R(1)};
        if (zero_pairs-- > 0) {
            n = {R(1), x[z], x[z + 1]};
            z += 2;
        } else if (single_zero && !s.single_pole()) {
            n = {R(0), R(1), b};
            single_zero = false;
        }
        system.modules.push_back({2, n, {R(1), x[k], x[k + 1]}});
    }
    if (s.single_pole())
        system.modules.push_back({1, {single_zero ? R(1) : R(0), single_zero ? b : R(1), R(0)}, {R(1), x[k], R(0)}});
    return system;
}

}  // namespace

TEST_CASE("refine: recovers a known model from perturbed starts on noise-free data, in every loop") {
    Random random(131);
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open})
        for (const bool limited : {false, true}) {
            if (limited && kind == LoopKind::open) continue;
            reference::Drive d = paper(kind);
            if (limited) d.loop.controller.torque_limit = 2.5;
            const Bench bench(d, {command(kind, 700, 1), command(kind, 300, 2)});
            const Refiner refiner(bench.experiment, wide());
            const Factors<double> truth = d.factors();
            const std::vector<double> x = pack(truth, {});
            double worst = 0.0;
            for (int repeat = 0; repeat < 5; ++repeat) {
                const Refined fit = refiner.fit(perturbed(truth, random, 0.2), {}, 60);
                CHECK(fit.converged);
                CHECK(fit.cost < 1e-12 * bench.scale());
                CHECK(fit.factors.structure == truth.structure);
                CHECK(fit.starts.empty());
                const std::vector<double> found = pack(fit.factors, {});
                for (std::size_t i = 0; i < x.size(); ++i) worst = std::max(worst, std::abs(found[i] / x[i] - 1.0));
                CHECK(fit.at_bound == std::vector<bool>(6, false));
            }
            std::printf("loop %d, limited %d: largest relative deviation of a parameter %.2g\n", static_cast<int>(kind),
                        limited ? 1 : 0, worst);
            CHECK(worst < 1e-5);
        }
}

TEST_CASE("refine: recovers every structure") {
    Random random(132);
    for (std::size_t p = 0; p <= 3; ++p)
        for (std::size_t q = 0; q <= 3; ++q) {
            const auto d = reference::random_drive(random, LoopKind::continuous, p, q, reference::Family::ordinary, 400, 3.0);
            const Bench bench(d, {command(LoopKind::continuous, 400, 3)});
            RefineOptions o;
            o.bounded = false;
            const Refiner refiner(bench.experiment, o);
            CHECK(refiner.parameters(d.factors().structure) == static_cast<int>(1 + p + 2 * q));
            const Factors<double> start = perturbed(d.factors(), random, 0.03);
            const double before = refiner.costs({&start, 1})[0];
            const Refined fit = refiner.fit(start, {}, 60);
            CHECK(fit.cost <= before);
            CHECK(fit.cost < 1e-9 * bench.scale());
            CHECK_NEAR(fit.cost, refiner.costs({&fit.factors, 1})[0], 1e-12 * bench.scale());
        }
}

TEST_CASE("refine: stays inside its bounds and says where it stands at one") {
    const Bench bench(paper(LoopKind::continuous), {command(LoopKind::continuous, 500, 4)}, 0.1);
    const Factors<double> truth = bench.drive.factors();
    Random random(133);
    const auto check = [&](const SearchRanges& ranges, std::size_t expected) {
        RefineOptions o = wide();
        o.ranges = ranges;
        const Refiner refiner(bench.experiment, o);
        for (int repeat = 0; repeat < 4; ++repeat) {
            const Refined fit = refiner.fit(perturbed(truth, random, 0.3), {}, 60);
            CHECK(fit.at_bound[expected]);
            std::complex<double> poles[3], zeros[2];
            roots_of(fit.factors, poles, zeros);
            for (const auto root : {poles[0], poles[1], poles[2], zeros[0], zeros[1]}) {
                CHECK(-root.real() >= ranges.real.lo - 1e-5 && -root.real() <= ranges.real.hi + 1e-5);
                CHECK(std::abs(root.imag()) <= ranges.imaginary.hi + 1e-9);
            }
            CHECK(fit.factors.gain >= ranges.gain.lo * (1 - 1e-12) && fit.factors.gain <= ranges.gain.hi * (1 + 1e-12));
            std::vector<double> x = pack(fit.factors, {}), y = x;
            project(y, fit.factors.structure, ranges);
            for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(x[i], y[i], 1e-9 * std::abs(x[i]) + 1e-12);
        }
    };
    SearchRanges r = wide().ranges;
    r.gain.hi = 5000.0;  // true: 6545
    check(r, 0);
    r = wide().ranges;
    r.real = {0.0, 12.0};  // true: the single pole at 15.4
    check(r, 3);
    r = wide().ranges;
    r.imaginary.hi = 130.0;  // true: 150.9
    check(r, 2);
    // Without bounds the same start goes to the truth.
    RefineOptions free = wide();
    free.ranges = r;
    free.bounded = false;
    const Refined fit = Refiner(bench.experiment, free).fit(perturbed(truth, random, 0.1), {}, 60);
    CHECK_NEAR(std::sqrt(fit.factors.pole_pair[0].e0), std::sqrt(truth.pole_pair[0].e0), 3.0);
    CHECK(fit.at_bound == std::vector<bool>(6, false));
}

TEST_CASE("refine: whitening equals the error filtered explicitly, over chunks and records") {
    const std::vector<double> phi{0.6, -0.25, 0.1};
    const Bench bench(
        paper(LoopKind::continuous),
        {command(LoopKind::continuous, 1300, 5), command(LoopKind::continuous, 2, 6), command(LoopKind::continuous, 512, 7)},
        0.5);
    RefineOptions o = wide();
    o.whitening = phi;
    const Refiner refiner(bench.experiment, o);
    Random random(134);
    std::vector<Factors<double>> points;
    for (int i = 0; i < 11; ++i) points.push_back(perturbed(bench.drive.factors(), random, 0.1));
    points.push_back(reference::paper_drive(false).factors());  // another structure among them
    points.push_back(points[0]);
    const std::vector<double> costs = refiner.costs(points);
    CHECK(costs.size() == points.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
        std::vector<double> filtered;
        for (std::size_t r = 0; r < 3; ++r) {
            const std::size_t n = bench.inputs[r].size();
            std::vector<double> w(n), u(n);
            simulate<double>(points[k], bench.inputs[r], bench.drive.sample_time, bench.experiment.loop, nullptr, w, u);
            // Samples whose history is missing are left out.
            for (std::size_t i = 0; i < n; ++i) {
                double v = 0.0;
                if (i >= phi.size()) {
                    v = bench.outputs[r][i] - w[i];
                    for (std::size_t j = 0; j < phi.size(); ++j) v -= phi[j] * (bench.outputs[r][i - 1 - j] - w[i - 1 - j]);
                }
                filtered.push_back(v);
            }
        }
        double sum = 0.0;
        for (const double v : filtered) sum += v * v;
        CHECK_NEAR(costs[k], sum, 1e-10 * sum);
        if (k > 1) continue;
        std::vector<double> error, columns;
        refiner.sensitivities(points[k], {}, error, columns);
        CHECK(error.size() == filtered.size() && columns.size() == 6 * filtered.size());
        for (std::size_t i = 0; i < filtered.size(); ++i) CHECK_NEAR(error[i], filtered[i], 1e-9);
    }
    // And the fit minimises just that.
    const Refined fit = refiner.fit(points[0], {}, 60);
    CHECK_NEAR(fit.cost, refiner.costs({&fit.factors, 1})[0], 1e-9 * fit.cost);
    for (int i = 0; i < 20; ++i) {
        const Factors<double> beside = perturbed(fit.factors, random, 1e-3);
        CHECK(refiner.costs({&beside, 1})[0] >= fit.cost * (1 - 1e-12));
    }
}

TEST_CASE("refine: estimates the unknown state of records that start in motion") {
    Random random(135);
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open}) {
        Bench bench(paper(kind), {command(kind, 600, 8), command(kind, 600, 9), command(kind, 600, 10)});
        const Factors<double> truth = bench.drive.factors();
        const int n = start_states(truth.structure, bench.experiment.loop);
        CHECK(n == (kind == LoopKind::open ? 3 : 4));
        // Records 0 and 2 begin somewhere in the motion of another one; record 1 at rest.
        std::vector<double> states;
        for (const std::size_t r : {0U, 2U}) {
            std::vector<double> start(static_cast<std::size_t>(n));
            const Delta<double> plant = plant_of(truth, bench.experiment.loop, bench.drive.sample_time);
            steady_state(plant, 12.0 + static_cast<double>(r), 0.2, start.data());
            for (double& x : start) x *= 1.0 + 0.1 * (random.uniform() - 0.5);
            if (kind != LoopKind::open) start.back() = 0.15;
            std::vector<double> unused(600);
            simulate<double>(truth, bench.inputs[r], bench.drive.sample_time, bench.experiment.loop, start.data(),
                             bench.outputs[r], unused);
            bench.experiment.records[r].start = Start::free;
            bench.experiment.records[r].velocity0 = bench.outputs[r][0];
            states.insert(states.end(), start.begin(), start.end());
        }
        const Refiner refiner(bench.experiment, wide());
        CHECK(refiner.parameters(truth.structure) == 6 + 2 * n);
        const Refined fit = refiner.fit(perturbed(truth, random, 0.1), {}, 80);
        CHECK(fit.cost < 1e-10 * bench.scale());
        CHECK(fit.starts.size() == states.size());
        double size = 0.0, worst = 0.0;
        for (const double x : states) size = std::max(size, std::abs(x));
        for (std::size_t i = 0; i < states.size(); ++i) worst = std::max(worst, std::abs(fit.starts[i] - states[i]) / size);
        std::printf("loop %d: largest deviation of a start state %.2g of the largest, cost %.2g of the signal\n",
                    static_cast<int>(kind), worst, fit.cost / bench.scale());
        CHECK(worst < 1e-4);
        CHECK(fit.at_bound.size() == 6);
        // Given back as a start, the fit has nothing left to do.
        CHECK(refiner.fit(fit.factors, fit.starts, 1).cost <= fit.cost * (1 + 1e-6) + 1e-20 * bench.scale());
    }
}

TEST_CASE("refine: derivatives by forward differences equal the referee's central differences") {
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open}) {
        Random random(136);
        double worst = 0.0;
        for (int repeat = 0; repeat < 8; ++repeat) {
            const std::size_t p = 1 + random.below(2), q = random.below(4);
            reference::Drive d = reference::random_drive(random, kind, p, q, reference::Family::ordinary, 300, 3.0);
            const Bench bench(d, {command(kind, 300, 11)});
            RefineOptions o;
            o.bounded = false;
            const Factors<double> g = d.factors();
            std::vector<double> error, columns;
            Refiner(bench.experiment, o).sensitivities(g, {}, error, columns);
            const std::vector<double> x = pack(g, {});
            CHECK(columns.size() == x.size() * 300);
            std::vector<long double> exact(x.begin(), x.end());
            for (std::size_t j = 0; j < x.size(); ++j) {
                const long double h = 1e-6L * (j == 0 ? 1.0L : std::abs(exact[j]));
                std::vector<long double> w[2];
                for (const int side : {0, 1}) {
                    std::vector<long double> moved = exact;
                    moved[j] += side == 0 ? h : -h;
                    w[side] =
                        reference::run(system_of(moved, std::exp(moved[0]), g.structure), bench.inputs[0], d.sample_time, d.loop)
                            .velocity;
                }
                std::vector<double> column(columns.begin() + static_cast<std::ptrdiff_t>(300 * j),
                                           columns.begin() + static_cast<std::ptrdiff_t>(300 * (j + 1)));
                std::vector<long double> central;
                for (std::size_t i = 0; i < 300; ++i) central.push_back((w[1][i] - w[0][i]) / (2.0L * h));  // of the error
                worst = std::max(worst, reference::deviation(column, central));
            }
        }
        std::printf("loop %d: largest deviation of a derivative %.2g\n", static_cast<int>(kind), worst);
        CHECK(worst < 1e-3);
    }
}

TEST_CASE("refine: a start that diverges comes back as the worst, untouched") {
    const Bench bench(paper(LoopKind::continuous), {command(LoopKind::continuous, 3000, 12)});
    RefineOptions o = wide();
    o.bounded = false;
    const Factors<double> wild =
        factors_from_roots(1e4, std::vector<std::complex<double>>{2000.0, {900.0, 700.0}, {900.0, -700.0}}, {});
    const Refined fit = Refiner(bench.experiment, o).fit(wild, {}, 20);
    CHECK(fit.cost == worst_error_sum);
    CHECK(!fit.converged);
    CHECK(fit.factors.structure == wild.structure);
}

TEST_CASE("refine: every kernel set takes the same path") {
    Bench bench(paper(LoopKind::continuous), {command(LoopKind::continuous, 600, 13)}, 0.2);
    Random random(137);
    const Factors<double> start = perturbed(bench.drive.factors(), random, 0.2);
    std::vector<Refined> fits;
    for (const char* name : {"baseline", "avx2", "avx512"}) {
        const Kernels* k = kernels_named(name);
        if (k == nullptr) continue;
        bench.experiment.kernels = k;
        fits.push_back(Refiner(bench.experiment, wide()).fit(start, {}, 30));
        CHECK(fits.back().cost == fits.front().cost);
        CHECK(fits.back().iterations == fits.front().iterations);
        CHECK(pack(fits.back().factors, {}) == pack(fits.front().factors, {}));
    }
}
