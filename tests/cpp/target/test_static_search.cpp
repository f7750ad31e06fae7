// The search that runs in a drive, against the host's.
#include "check.hpp"
#include "drive_bench.hpp"
#include "fixed_bound.hpp"
#include "gaident/numeric/c30.hpp"
#include "gaident/numeric/denormals.hpp"
#include "gaident/identification/chromosomes.hpp"
#include "gaident/identification/plant_search.hpp"
#include "gaident/target/mirror.hpp"
#include "gaident/target/fixed_scaling.hpp"
#include "gaident/target/static_search.hpp"

#include <array>
#include <functional>
#include <memory>

using namespace gaident;

namespace {

template <class A>
struct Tables {
    std::vector<typename A::Number> gain, real, imaginary;
    Genome genome{SearchRanges{}, Code::binary, Scale::linear};

    Tables() {
        const auto fill = [&](auto& table, const Field& f) {
            for (std::uint32_t bits = 0; bits < 1U << f.width; ++bits)
                table.push_back(typename A::Number(genome.value_of(bits, f)));
        };
        fill(gain, genome.field(Role::gain, Part::whole, 0));
        fill(real, genome.field(Role::pole1, Part::real, 0));
        fill(imaginary, genome.field(Role::pole1, Part::imaginary, 0));
    }
    StaticSetup<A> setup(const Bench& bench, std::uint64_t seed) const {
        const reference::Drive& d = bench.drive;
        StaticSetup<A> s;
        s.genome = &genome;
        s.values.gain = gain.data();
        s.values.real = real.data();
        s.values.imaginary = imaginary.data();
        for (auto& unit : s.values.unit) unit = typename A::Number(1.0);
        s.controller = d.loop.controller;
        s.clock.period = d.sample_time;
        for (const auto* signal : {&bench.measured.input, &bench.measured.output})
            for (const double v : *signal) s.peak = std::max(s.peak, std::abs(v));
        s.seed = seed;
        return s;
    }
};

template <class A>
Trial run(const Bench& bench, int generations, std::uint64_t seed) {
    const FlushDenormals flush;
    const Tables<A> tables;
    const auto search = std::make_unique<StaticSearch<A, 50, 250>>(tables.setup(bench, seed));
    for (std::size_t i = 0; i < 250; ++i) search->feed(bench.measured.input[i], bench.measured.output[i]);
    Trial t;
    for (int g = 0; g < generations; ++g) {
        search->generation();
        t.history.push_back(static_cast<double>(search->least_cost()));
    }
    t.best_fitness = static_cast<double>(search->best_fitness());
    t.best_generation = search->best_generation();
    t.best.assign(search->best(), search->best() + 4);
    return t;
}

// A record that settles under a constant command, and one that is driven.
std::array<Bench, 2> records() {
    reference::Drive driven = two_mass();
    for (std::size_t i = 100; i < driven.input.size(); ++i) driven.input[i] = -20.0;
    return {Bench(two_mass()), Bench(driven)};
}

Trial host(const Bench& bench, const char* mirror, int generations, std::uint64_t seed) {
    PlantSettings s;
    s.generations = generations;
    s.mirror = mirror;
    Progress progress;
    return search_plant(bench.experiment, SearchRanges{}, s, 1, seed, 1, progress)[0];
}

bool same(const Trial& a, const Trial& b) {
    return a.history == b.history && a.best == b.best && a.best_fitness == b.best_fitness &&
           a.best_generation == b.best_generation;
}

}  // namespace

TEST_CASE("static search: in double the host's run, bit for bit; settling and driven records") {
    for (const Bench& bench : records()) {
        CHECK(same(run<Plain<double>>(bench, 60, 4), host(bench, "", 60, 4)));
        CHECK(same(run<Plain<double>>(bench, 60, 4), host(bench, "drive_double", 60, 4)));
    }
}

TEST_CASE("static search: in a drive's arithmetic the run of its mirror on the host, bit for bit") {
    for (const Bench& bench : records()) {
        CHECK(same(run<Plain<float>>(bench, 30, 4), host(bench, "drive_float", 30, 4)));
        CHECK(same(run<Plain<C30Word, C30>>(bench, 30, 4), host(bench, "c30", 30, 4)));
        CHECK(same(run<FixedPoint<2>>(bench, 30, 4), host(bench, "fixed", 30, 4)));
        CHECK(!same(run<Plain<float>>(bench, 30, 4), host(bench, "c30", 30, 4)));
    }
}

TEST_CASE("static search: slices of any size make the same run; a full record takes no more samples") {
    const Bench bench(two_mass());
    const Tables<Plain<float>> tables;
    using Search = StaticSearch<Plain<float>, 50, 250>;
    const auto whole = std::make_unique<Search>(tables.setup(bench, 9)),
               sliced = std::make_unique<Search>(tables.setup(bench, 9));
    for (Search* s : {whole.get(), sliced.get()}) {
        for (std::size_t i = 0; i < 250; ++i) {
            CHECK(!s->full());
            CHECK(s->feed(bench.measured.input[i], bench.measured.output[i]));
        }
        CHECK(s->full() && !s->feed(1.0, 1.0) && s->samples() == 250);
    }
    CHECK(whole->generations() == 0);
    CHECK(sliced->work(1) == 0);  // the first population is drawn
    for (const int n : {0, -1, std::numeric_limits<int>::min()}) CHECK(sliced->work(n) == 0);
    while (whole->generation() < 5) {
    }
    for (int n = 1; sliced->work(n) < 5;) n = n % 7 + 1;
    CHECK(whole->best_fitness() == sliced->best_fitness() && whole->best_generation() == sliced->best_generation());
    for (int w = 0; w < 200; ++w) CHECK(whole->chromosomes()[w] == sliced->chromosomes()[w]);
    for (int i = 0; i < 50; ++i) CHECK(whole->costs()[i] == sliced->costs()[i]);
    const Factors<double> f = decode(whole->best(), tables.genome);
    CHECK(whole->best_model().structure == f.structure);
    CHECK_NEAR(whole->best_model().gain, f.gain, 1e-6 * f.gain);
}

TEST_CASE("static search: no model comes of a record with a sample that is none or beyond twice the peak") {
    const Bench bench(two_mass());
    const auto best = [&]<class A>(A, double bad, double peak) {
        const Tables<A> tables;
        StaticSetup<A> setup = tables.setup(bench, 9);
        const double largest = setup.peak;
        setup.peak *= peak;
        const auto search = std::make_unique<StaticSearch<A, 50, 250>>(setup);
        for (std::size_t i = 0; i < 250; ++i) {
            CHECK(!search->spoiled() || i > 100);
            search->feed(bench.measured.input[i], i == 100 ? bad * largest : bench.measured.output[i]);
        }
        search->generation();
        const bool none = !(search->best_fitness() < A::worst());
        CHECK(none == search->spoiled());
        return !none;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN(), endless = std::numeric_limits<double>::infinity();
    CHECK(best(Plain<float>(), 1.9, 1.0) && best(FixedPoint<2>(), 1.9, 1.0));
    for (const double bad : {nan, endless, -endless, 2.1, -2.1, 1e300})
        CHECK(!best(Plain<float>(), bad, 1.0) && !best(FixedPoint<2>(), bad, 1.0));
    // Floats need no peak, and fixed point refuses to go without one.
    CHECK(best(Plain<float>(), 2.1, 0.0) && !best(Plain<float>(), nan, 0.0) && !best(Plain<double>(), endless, 0.0));
    CHECK_THROWS(best(FixedPoint<2>(), 1.0, 0.0), std::invalid_argument);
}

TEST_CASE("mirror: two records, and records that begin in motion, cost what double says; overflows are counted") {
    Bench bench(two_mass());
    bench.experiment.records.push_back(bench.experiment.records[0]);
    bench.experiment.records[1].start = Start::steady;
    bench.experiment.records[1].velocity0 = 40.0;
    const Genome genome(SearchRanges{}, Code::binary, Scale::linear);
    const Decoder decoder(genome);
    Population all(200, genome.words());
    Random random(2);
    for (std::size_t i = 0; i < all.size(); ++i)
        for (int w = 0; w < all.words(); ++w) all[i][w] = random.word();
    std::vector<double> exact(all.size()), found(all.size());
    Batch(bench.experiment, all.size(), false).errors(Chromosomes(all, decoder), exact);
    for (std::size_t i = 0; i < all.size(); ++i) exact[i] = fitness(exact[i], decoder.structure(all[i]), {});
    double peak = 0.0;
    for (const auto* signal : {&bench.measured.input, &bench.measured.output})
        for (const double v : *signal) peak = std::max(peak, std::abs(v));
    const Tables<Plain<Doubtful>> tables;
    const GeneValues<Doubtful> values = tables.setup(bench, 0).values;
    const auto in_fixed_point = [&](int headroom) {
        return [&, headroom](std::size_t i) {
            const auto doubtful = decode<Plain<Doubtful>>(all[i], genome, values);
            const auto factors = decode(all[i], genome);
            double bound = 4.0 * exact[i] / 2147483648.0;
            for (const Record& r : bench.experiment.records)
                bound += error_sum_bound(headroom, factors, doubtful, r, bench.experiment.loop, genome.ranges(), peak);
            return bound / exact[i];
        };
    };
    // What a candidate's fitness may be off, relative to double's.
    // Fixed point's: derived.
    // The floats': measured, the worst of these 200 is 6.6e-6 and 1.5e-5, of 4000 others 1.1e-5 and 2.5e-5 (docs/dsp.md has more
    // figures).
    const auto within = [](double tolerance) { return [tolerance](std::size_t) { return tolerance; }; };
    const struct {
        const char* name;
        std::function<double(std::size_t)> bound;
    } rows[] = {{"drive_double", within(1e-12)}, {"drive_float", within(2e-5)},      {"c30", within(2e-5)},
                {"fixed", in_fixed_point(2)},    {"fixed_tight", in_fixed_point(0)}, {"fixed_wide", in_fixed_point(6)}};
    for (const auto& row : rows) {
        const auto mirror = make_mirror(row.name, bench.experiment, genome, {});
        mirror->evaluate(all, found);
        std::size_t worst = 0;
        double deviation = 0.0, share = 0.0;
        std::vector<double> bounds;
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (!(found[i] < worst_fitness)) {
                ++worst;
                continue;
            }
            const double off = std::abs(found[i] / exact[i] - 1.0), bound = row.bound(i);
            CHECK(off <= bound);
            deviation = std::max(deviation, off);
            share = std::max(share, off / bound);
            bounds.push_back(bound);
        }
        std::nth_element(bounds.begin(), bounds.begin() + bounds.size() / 2, bounds.end());
        const double median = bounds[bounds.size() / 2];
        std::printf("%-12s deviation of the fitness %.2g, %.2g of its bound; bound in the median %.2g; overflows %zu of %zu\n",
                    row.name, deviation, share, median, worst, all.size());
        CHECK(median < 1e-3);  // a bound that says something
        CHECK(mirror->overflows() == worst && worst < all.size() / 2);
    }
    CHECK(mirror_names().size() == std::size(rows));
    CHECK_THROWS(make_mirror("half", bench.experiment, genome, {}), std::invalid_argument);
    bench.experiment.loop.controller.torque_limit = 1.0;
    CHECK_THROWS(make_mirror("c30", bench.experiment, genome, {}), std::invalid_argument);
}
