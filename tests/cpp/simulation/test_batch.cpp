#include "check.hpp"
#include "gaident/runtime/parallel.hpp"
#include "gaident/simulation/simulate.hpp"
#include "gaident/reference/drives.hpp"

using namespace gaident;

namespace {

std::vector<const Kernels*> available() {
    std::vector<const Kernels*> all;
    for (const char* name : {"baseline", "avx2", "avx512"})
        if (const Kernels* k = kernels_named(name)) all.push_back(k);
    return all;
}

// Candidates of every structure around the paper's two-mass drive, in no order.
std::vector<reference::Plant> candidates(Random& random, std::size_t count, std::size_t p_min) {
    std::vector<reference::Plant> all;
    while (all.size() < count) {
        reference::Plant g = reference::random_plant(random, p_min + random.below(static_cast<std::uint32_t>(4 - p_min)),
                                                     random.below(4), reference::Family::ordinary, 2e-3, 250);
        g.K = reference::log_uniform(random, 1e3, 2e4);
        for (std::size_t i = 1; i < g.A1.size(); ++i) g.K *= 100.0;
        all.push_back(g);
    }
    return all;
}

struct Setup {
    std::vector<std::vector<double>> inputs, outputs;
    Experiment experiment;

    Setup(Random& random, const Loop& loop, const std::vector<std::size_t>& lengths, double Ts) {
        experiment.loop = loop;
        for (const std::size_t n : lengths) {
            inputs.push_back(reference::random_signal(random, n));
            outputs.emplace_back();
            for (const double r : inputs.back()) outputs.back().push_back(0.8 * r + reference::normal(random));
        }
        for (std::size_t i = 0; i < lengths.size(); ++i) {
            Record r;
            r.input = inputs[i];
            r.output = outputs[i];
            r.sample_time = Ts;
            experiment.records.push_back(r);
        }
    }
    // By the referee. Also the sum of squares of the outputs, for scale.
    double sum(const reference::Plant& g, double* scale) const {
        long double total = 0.0, size = 0.0;
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            const auto w = reference::run(reference::factor_modules<long double>(g), inputs[i], experiment.records[i].sample_time,
                                          experiment.loop)
                               .velocity;
            for (std::size_t k = 0; k < w.size(); ++k) {
                const long double y = static_cast<long double>(outputs[i][k]);
                total += (y - w[k]) * (y - w[k]);
                size += y * y + w[k] * w[k];
            }
        }
        *scale = static_cast<double>(size);
        return static_cast<double>(total);
    }
};

Loop paper_loop(LoopKind kind) {
    Loop loop = reference::paper_drive(true).loop;
    loop.kind = kind;
    return loop;
}

}  // namespace

TEST_CASE("batch: error sums of a mixture of structures equal the referee's; several records, longer than a chunk") {
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open})
        for (const bool limited : {false, true}) {
            Random random(91);
            Loop loop = paper_loop(kind);
            if (limited) loop.controller.torque_limit = 2.0;
            const Setup setup(random, loop, {130, 1100, 1, 512}, 0.444e-3);
            const auto plants = candidates(random, 43, kind == LoopKind::continuous ? 0 : 1);
            std::vector<Factors<double>> factors;
            for (const auto& g : plants) factors.push_back(reference::factors_of(g));
            std::vector<double> sums(factors.size()), in_float(factors.size());
            Batch(setup.experiment, 50, false).errors(factors, sums);
            Batch(setup.experiment, 50, true).errors(factors, in_float);
            double worst = 0.0, worst_float = 0.0;
            int compared = 0, compared_float = 0;
            for (std::size_t i = 0; i < plants.size(); ++i) {
                double scale;
                const double exact = setup.sum(plants[i], &scale);
                CHECK(!std::isnan(sums[i]) && !std::isnan(in_float[i]));
                if (!(exact < 1e30)) continue;  // diverging
                ++compared;
                worst = std::max(worst, std::abs(sums[i] - exact) / scale);
                if (exact > 1e8 * static_cast<double>(plants.size())) continue;
                ++compared_float;
                worst_float = std::max(worst_float, std::abs(in_float[i] - exact) / scale);
            }
            std::printf("loop %d, limited %d: double %.2g (%d), float %.2g (%d)\n", static_cast<int>(kind), limited ? 1 : 0,
                        worst, compared, worst_float, compared_float);
            CHECK(compared > 20 && compared_float > 10);
            CHECK(worst < 1e-9);
            CHECK(worst_float < 1e-4);
        }
}

TEST_CASE("batch: eight candidates prepared side by side are the eight prepared alone, p and q up to 7") {
    Random random(96);
    for (const Kernels* kernels : available())
        for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open})
            for (int repeat = 0; repeat < 100; ++repeat) {
                Loop loop = paper_loop(kind);
                if (repeat % 3 == 0) loop.controller.torque_limit = 2.0;
                Setup setup(random, loop, {10}, 0.444e-3);
                setup.experiment.kernels = kernels;
                Record& record = setup.experiment.records[0];
                record.start = repeat % 2 == 0 ? Start::rest : Start::steady;
                record.velocity0 = 11.0;
                // Any mixture of structures in the continuous loop, one structure behind a hold; all lanes used or not.
                std::vector<Factors<double>> models;
                const bool mixed = kind == LoopKind::continuous;
                const std::size_t used = 1 + random.below(8), p0 = 1 + random.below(7), q0 = random.below(8);
                for (std::size_t i = 0; i < used; ++i) {
                    auto g = reference::random_plant(random, mixed ? random.below(8) : p0, mixed ? random.below(8) : q0,
                                                     reference::families[random.below(4)], 0.444e-3, 250);
                    g.K = 100.0;
                    models.push_back(reference::factors_of(g));
                }
                std::vector<const Factors<double>*> lanes;
                std::vector<std::vector<double>> states;
                std::vector<const double*> starts;
                for (const auto& m : models) {
                    lanes.push_back(&m);
                    states.emplace_back();
                    for (int k = 0; k < start_states(m.structure, loop); ++k) states.back().push_back(random.uniform());
                }
                const bool with_starts = repeat % 5 == 0;
                for (const auto& x : states)
                    if (with_starts) starts.push_back(x.data());
                DoubleGroup group;
                load_group(setup.experiment, record, lanes, starts, group);
                int order = 0;
                for (std::size_t lane = 0; lane < DoubleGroup::width; ++lane) {
                    const std::size_t i = std::min(lane, used - 1);
                    const Prepared one = prepare(models[i], record, loop, with_starts ? starts[i] : nullptr);
                    const int n = one.response.order;
                    order = std::max(order, n);
                    // Behind a hold the group doubles as often as its fastest lane needs, which moves the last digits.
                    double size_a = 0.0, size_b = 0.0;
                    for (int k = 0; k < n; ++k) size_a = std::max(size_a, std::abs(one.response.a[k]));
                    for (int k = 0; k <= n; ++k) size_b = std::max(size_b, std::abs(one.response.b[k]));
                    for (int k = 0; k < group.order; ++k) {
                        const double a = k < n ? one.response.a[k] : 0.0;
                        CHECK_NEAR(group.a[k][lane], a, mixed ? 0.0 : 1e-11 * size_a);
                        CHECK(group.x[k][lane] == (k < n ? one.x[k] : 0.0));
                    }
                    for (int k = 0; k <= group.order; ++k)
                        CHECK_NEAR(group.b[k][lane], k <= n ? one.response.b[k] : 0.0, mixed ? 0.0 : 1e-11 * size_b);
                    CHECK(group.s[lane] == one.s);
                }
                CHECK(group.order == order);
            }
}

TEST_CASE(
    "batch: in float within 1e-4 wherever the roots lie, up to Nyquist; what plain floats cannot hold does not touch its "
    "neighbours") {
    Random random(97);
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled}) {
        double worst = 0.0;
        int compared = 0, beyond = 0;
        for (int repeat = 0; repeat < 40; ++repeat) {
            // One loop for all: the gains are those of the first drive's loop.
            const auto d = reference::random_drive(random, kind, 1, 2, reference::Family::fast, 250);
            Setup setup(random, d.loop, {250}, d.sample_time);
            std::vector<Factors<double>> factors;
            std::vector<reference::Plant> plants;
            for (int i = 0; i < 12; ++i) {
                const auto family = i % 3 == 0 ? reference::Family::ordinary : reference::Family::fast;
                auto other = reference::random_drive(random, kind, 1 + random.below(3), random.below(4), family, 250);
                const double time = other.sample_time / d.sample_time;
                for (auto* roots : {&other.plant.A1, &other.plant.A2, &other.plant.B2})
                    for (auto& a : *roots) a *= time;
                for (std::size_t k = 0; k < other.plant.A1.size(); ++k) other.plant.K *= time;
                other.plant.K *= other.loop.controller.kp / d.loop.controller.kp;
                plants.push_back(other.plant);
                factors.push_back(reference::factors_of(other.plant));
            }
            std::vector<double> sums(12), one(1);
            Batch batch(setup.experiment, 12, true);
            batch.errors(factors, sums);
            for (std::size_t i = 0; i < 12; ++i) {
                batch.errors(std::span(factors).subspan(i, 1), one);
                if (kind == LoopKind::continuous) CHECK(one[0] == sums[i]);
                double scale;
                const double exact = setup.sum(plants[i], &scale);
                if (!(scale < 1e12)) continue;  // diverging
                worst = std::max(worst, std::abs(sums[i] - exact) / scale);
                ++compared;
                const auto h = prepare(factors[i], setup.experiment.records[0], d.loop, nullptr).response;
                if (!float_suffices(h.order, [&](int k) { return h.a[k]; })) ++beyond;
            }
        }
        std::printf("loop %d: worst %.2g, %d candidates, %d of them beyond plain floats\n", static_cast<int>(kind), worst,
                    compared, beyond);
        CHECK(worst < 1e-4);
        CHECK(compared > 300 && beyond > 100 && beyond < compared - 100);
    }
}

TEST_CASE("batch: every kernel set gives the same sums, and neighbours do not matter") {
    Random random(92);
    for (const bool limited : {false, true})
        for (const bool in_float : {false, true}) {
            Loop loop = paper_loop(LoopKind::continuous);
            if (limited) loop.controller.torque_limit = 2.0;
            Setup setup(random, loop, {250, 600}, 0.444e-3);
            std::vector<Factors<double>> factors;
            for (const auto& g : candidates(random, 50, 0)) factors.push_back(reference::factors_of(g));
            std::vector<double> first(50);
            setup.experiment.kernels = &baseline_kernels();
            Batch(setup.experiment, 50, in_float).errors(factors, first);
            for (const Kernels* k : available()) {
                setup.experiment.kernels = k;
                std::vector<double> sums(50), reversed(50), alone(1);
                Batch batch(setup.experiment, 50, in_float);
                batch.errors(factors, sums);
                CHECK(sums == first);
                std::vector<Factors<double>> backwards(factors.rbegin(), factors.rend());
                batch.errors(backwards, reversed);
                batch.errors(std::span(factors).first(1), alone);
                for (std::size_t i = 0; i < 50; ++i) CHECK(reversed[49 - i] == first[i]);
                CHECK(alone[0] == first[0]);
            }
        }
}

TEST_CASE("batch: a long record is shared among workers to the same bits; a small generation is not") {
    Random random(101);
    for (const bool limited : {false, true})
        for (const bool constant : {false, true}) {
            Loop loop = paper_loop(LoopKind::continuous);
            if (limited) loop.controller.torque_limit = 2.0;
            Setup setup(random, loop, {9000, 250}, 0.444e-3);
            if (constant) std::fill(setup.inputs[0].begin(), setup.inputs[0].end(), 20.0);
            std::vector<Factors<double>> factors;
            for (const auto& g : candidates(random, 50, 0)) factors.push_back(reference::factors_of(g));
            for (const bool in_float : {false, true})
                for (const Kernels* k : available()) {
                    setup.experiment.kernels = k;
                    setup.experiment.workers = nullptr;
                    std::vector<double> alone(50);
                    Batch(setup.experiment, 50, in_float).errors(factors, alone);
                    for (const int count : {1, 2, 3}) {
                        Workers workers(count);
                        setup.experiment.workers = &workers;
                        std::vector<double> sums(50), few(10);
                        Batch batch(setup.experiment, 50, in_float);
                        batch.errors(std::span(factors).first(10), few);
                        CHECK(workers.helpers() == 0);
                        CHECK(std::equal(few.begin(), few.end(), alone.begin()));
                        batch.errors(factors, sums);
                        CHECK(workers.helpers() + 1 == static_cast<std::size_t>(count));
                        CHECK(sums == alone);
                    }
                }
        }
}

TEST_CASE(
    "batch: a constant command, which has a loop of its own, gives the referee's sums in every instruction set, from rest and in "
    "motion") {
    Random random(98);
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled}) {
        Setup setup(random, paper_loop(kind), {250, 700, 90}, 0.444e-3);
        for (double& r : setup.inputs[0]) r = 43.6;
        for (double& r : setup.inputs[1]) r = -7.0;  // longer than a chunk
        const auto plants = candidates(random, 43, kind == LoopKind::continuous ? 0 : 1);
        std::vector<Factors<double>> factors;
        for (const auto& g : plants) factors.push_back(reference::factors_of(g));
        for (const bool in_float : {false, true}) {
            std::vector<double> first;
            for (const Kernels* k : available()) {
                setup.experiment.kernels = k;
                std::vector<double> sums(43), alone(1);
                Batch batch(setup.experiment, 43, in_float);
                batch.errors(factors, sums);
                if (first.empty()) first = sums;
                CHECK(sums == first);
                batch.errors(std::span(factors).subspan(30, 1), alone);
                if (kind == LoopKind::continuous) CHECK(alone[0] == sums[30]);
            }
            double worst = 0.0;
            for (std::size_t i = 0; i < plants.size(); ++i) {
                double scale;
                const double exact = setup.sum(plants[i], &scale);
                if (exact < 1e10) worst = std::max(worst, std::abs(first[i] - exact) / scale);
            }
            std::printf("loop %d, float %d: %.2g\n", static_cast<int>(kind), in_float ? 1 : 0, worst);
            CHECK(worst < (in_float ? 1e-4 : 1e-9));
        }
        // A start in motion: the same model as a driven record (a last sample that differs rules the short cut out).
        std::vector<double> driven = setup.inputs[0];
        driven.back() += 1.0;
        Experiment one = setup.experiment, other = setup.experiment;
        for (Experiment* e : {&one, &other}) {
            e->records.resize(1);
            e->records[0].start = Start::steady;
            e->records[0].velocity0 = 20.0;
        }
        other.records[0].input = driven;
        std::vector<double> a(43), b(43);
        Batch(one, 43, false).errors(factors, a);
        Batch(other, 43, false).errors(factors, b);
        for (std::size_t i = 0; i < 43; ++i) {
            std::vector<double> y(250), u(250);
            if (a[i] > 1e10) continue;
            double start[max_loop_order + 1] = {};
            steady_start(plant_of(factors[i], one.loop, 0.444e-3), one.records[0], one.loop, start);
            simulate<double>(factors[i], setup.inputs[0], 0.444e-3, one.loop, start, y, u);
            const double d = setup.outputs[0][249] - y[249];
            simulate<double>(factors[i], driven, 0.444e-3, one.loop, start, y, u);
            const double e = setup.outputs[0][249] - y[249];
            CHECK_NEAR(a[i] - d * d, b[i] - e * e, 1e-9 * (a[i] + 1.0));
        }
    }
}

TEST_CASE("batch: a candidate that diverges is the worst, never NaN") {
    Random random(93);
    Setup setup(random, paper_loop(LoopKind::continuous), {4000}, 0.444e-3);
    using Roots = std::vector<std::complex<double>>;
    std::vector<Factors<double>> factors;
    const Factors<double> calm = reference::paper_drive(true).factors();
    for (int i = 0; i < 40; ++i)
        factors.push_back(i % 3 == 0 ? calm
                                     : factors_from_roots(1e4, Roots{1500.0 + i, {800.0, 900.0}, {800.0, -900.0}}, Roots{}));
    for (const bool in_float : {false, true}) {
        std::vector<double> sums(40);
        Batch(setup.experiment, 40, in_float).errors(factors, sums);
        for (std::size_t i = 0; i < 40; ++i) {
            CHECK(i % 3 == 0 ? sums[i] < 1e12 : sums[i] == worst_error_sum);
            CHECK(i % 3 != 0 || sums[i] == sums[0]);
        }
    }
}

TEST_CASE("batch: a record in steady motion is the record from rest, shifted") {
    Random random(94);
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open})
        for (const bool limited : {false, true}) {
            if (limited && kind == LoopKind::open) continue;
            reference::Drive d = reference::paper_drive(true);
            d.loop.kind = kind;
            if (limited) d.loop.controller.torque_limit = 1e6;  // never reached, but the loop is run step by step
            d.input = reference::random_signal(random, 400);
            const auto rest = d.respond<long double>().velocity;
            const double y0 = 25.0;
            double dc = d.plant.K;
            std::complex<double> ratio = 1.0 / d.plant.A1[0];
            for (std::size_t j = 0; j < 2; ++j) ratio *= d.plant.B2[j] / d.plant.A2[j];
            dc *= ratio.real();
            // In a closed loop steady motion at y0 needs the command y0, in open loop the torque y0/G(0).
            std::vector<double> input, output;
            for (std::size_t i = 0; i < 400; ++i) {
                input.push_back(d.input[i] + (kind == LoopKind::open ? y0 / dc : y0));
                output.push_back(static_cast<double>(rest[i]) + y0);
            }
            Experiment experiment;
            experiment.loop = d.loop;
            Record r;
            r.input = input;
            r.output = output;
            r.sample_time = d.sample_time;
            r.start = Start::steady;
            r.velocity0 = y0;
            experiment.records.push_back(r);
            double scale = 0.0;
            for (const double w : output) scale += w * w;
            double sum;
            const Factors<double> g = d.factors();
            Batch(experiment, 1, false).errors({&g, 1}, {&sum, 1});
            CHECK(sum < 1e-18 * scale);
            experiment.records[0].start = Start::free;  // the genetic search takes such a record as steady
            Batch(experiment, 1, false).errors({&g, 1}, {&sum, 1});
            CHECK(sum < 1e-18 * scale);
            experiment.records[0].start = Start::rest;
            Batch(experiment, 1, false).errors({&g, 1}, {&sum, 1});
            CHECK(sum > 1e-9 * scale);
        }
}

TEST_CASE("batch: an experiment that makes no sense is refused, and the stop flag ends a long one") {
    Random random(95);
    const Setup good(random, paper_loop(LoopKind::continuous), {100}, 1e-3);
    good.experiment.check();
    CHECK(good.experiment.samples() == 100);
    const auto refused = [&](auto&& change) {
        Experiment e = good.experiment;
        change(e);
        CHECK_THROWS(e.check(), std::invalid_argument);
    };
    refused([](Experiment& e) { e.records.clear(); });
    refused([](Experiment& e) { e.records[0].input = e.records[0].input.first(99); });
    refused([](Experiment& e) { e.records[0].input = e.records[0].output = {}; });
    refused([](Experiment& e) { e.records[0].sample_time = 0.0; });
    refused([](Experiment& e) { e.records[0].sample_time = std::nan(""); });

    Experiment e = good.experiment;
    const std::atomic<bool> stop{true};
    e.stop = &stop;
    const Factors<double> g = reference::paper_drive(true).factors();
    double sum;
    CHECK_THROWS(Batch(e, 1, false).errors({&g, 1}, {&sum, 1}), Stopped);
}
