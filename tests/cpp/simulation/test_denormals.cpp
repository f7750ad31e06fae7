#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/identification/plant_search.hpp"
#include "gaident/runtime/parallel.hpp"
#include "gaident/simulation/simulate.hpp"
#include "gaident/estimation/statistics.hpp"

#include <stdexcept>

using namespace gaident;

namespace {

// Half of the smallest ordinary number: zero where denormals are flushed.
double half_of_smallest() {
    volatile double smallest = std::numeric_limits<double>::min();
    volatile double half = smallest * 0.5;
    return half;
}

#if defined(__SSE2__)
unsigned control_word() { return _mm_getcsr() & ~0x3FU; }  // without the sticky exception flags
#else
unsigned control_word() { return 0; }
#endif

void throws_inside() {
    const FlushDenormals flush;
    throw std::runtime_error("inside");
}

}  // namespace

TEST_CASE("denormals: flushed while the guard lives, and restored after") {
    const unsigned before = control_word();
    CHECK(half_of_smallest() > 0.0);
    {
        const FlushDenormals flush;
#if defined(__SSE2__) || defined(__aarch64__)
        CHECK(half_of_smallest() == 0.0);
#endif
        {
            const FlushDenormals inner;
        }
#if defined(__SSE2__) || defined(__aarch64__)
        CHECK(half_of_smallest() == 0.0);
#endif
    }
    CHECK(half_of_smallest() > 0.0);
    CHECK(control_word() == before);
}

TEST_CASE("denormals: restored also after a throw") {
    const unsigned before = control_word();
    CHECK_THROWS(throws_inside(), std::runtime_error);
    CHECK(half_of_smallest() > 0.0);
    CHECK(control_word() == before);
    CHECK_THROWS(parallel(3, 2, [](std::size_t) { throw std::runtime_error("inside"); }), std::runtime_error);
    CHECK(half_of_smallest() > 0.0);
    CHECK(control_word() == before);
}

TEST_CASE("denormals: a caller who flushes already still does so afterwards") {
    const FlushDenormals own;
    const unsigned before = control_word();
    parallel(2, 2, [](std::size_t) {});
    CHECK(control_word() == before);
}

TEST_CASE("denormals: simulating leaves the control word alone, and a long decay meets no denormal") {
    const unsigned before = control_word();
    std::vector<double> input(20000, 0.0), velocity(input.size()), torque(input.size());
    input[0] = 1.0;
    Loop loop;
    loop.kind = LoopKind::open;
    const Factors<double> g = factors_from_roots(100.0, std::vector<std::complex<double>>{-500.0}, {});
    simulate<double>(g, input, 1e-3, loop, nullptr, velocity, torque);
    CHECK(control_word() == before);
    CHECK(velocity[1] > 0.0);
    CHECK(std::abs(velocity.back()) < 1e-300);
#if defined(__SSE2__) || defined(__aarch64__)
    for (const double w : velocity) CHECK(std::fpclassify(w) != FP_SUBNORMAL);
#endif
}

TEST_CASE("denormals: every entry point restores the caller's state, also where it is stopped") {
    Bench bench(two_mass(LoopKind::sampled, 2000));
    const Factors<double> g = bench.drive.factors();
    std::atomic<bool> stop{false};
    bench.experiment.stop = &stop;
    PlantSettings settings;
    settings.species = true;
    settings.generations = settings.round = 2;
    SearchRanges ranges;
    ranges.p_min = ranges.p_max = 1;
    ranges.q_max = 1;
    RefineOptions unbounded;
    unbounded.bounded = false;
    const Refiner refiner(bench.experiment, unbounded);
    const std::function<void()> entries[] = {
        [&] {
            Progress progress;
            search_plant(bench.experiment, ranges, settings, 2, 1, 2, progress);
        },
        [&] { refiner.fit(g, {}, 2); },
        [&] { refiner.costs({&g, 1}); },
        [&] {
            std::vector<double> error, columns;
            refiner.sensitivities(g, {}, error, columns);
        },
        [&] { residual_sums(bench.experiment, g, {}, 5); },
        [&] { fit_sums(bench.experiment, g, {}, {}, std::vector<int>{0, 1}, 1.0); },
    };
    for (const auto& entry : entries) {
        const unsigned before = control_word();
        stop = false;
        entry();
        CHECK(control_word() == before);
        stop = true;
        CHECK_THROWS(entry(), Stopped);
        CHECK(control_word() == before);
        CHECK(half_of_smallest() > 0.0);
    }
}
