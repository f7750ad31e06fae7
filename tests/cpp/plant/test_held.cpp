#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/control/closed_loop.hpp"
#include "gaident/plant/held.hpp"

using namespace gaident;

namespace {

Delta<double> held(const Factors<double>& g, double Ts) { return held_plant(g, Ts, held_doublings(largest_root(g), Ts)); }

}  // namespace

TEST_CASE("held: the plant in open loop equals the referee's matrix exponential") {
    Random random(41);
    for (const auto family : reference::families) {
        double worst = 0.0, worst_float = 0.0, worst_large = 0.0, no_zeros = 0.0;
        for (std::size_t p = 1; p <= 7; ++p)
            for (std::size_t q = 0; q <= 7; ++q)
                for (int repeat = 0; repeat < 6; ++repeat) {
                    if (family == reference::Family::slow && p > 3) continue;  // response below anything visible
                    const auto d = reference::random_drive(random, LoopKind::open, p, q, family, 200);
                    const Delta<double> h = held(d.factors(), d.sample_time);
                    CHECK(h.order == static_cast<int>(p + q) && h.b[0] == 0.0);
                    const auto exact = d.respond<long double>().velocity;
                    const double e = reference::deviation(outputs<double>(h, d.input), exact);
                    const bool paper = p <= 3 && q <= 3;
                    (paper ? worst : worst_large) = std::max(paper ? worst : worst_large, e);
                    if (p <= 3 && q == 0) no_zeros = std::max(no_zeros, e);
                    if (paper) worst_float = std::max(worst_float, reference::deviation(outputs<float>(h, d.input), exact));
                }
        std::printf("family %d: double %.2g (p, q <= 3), %.2g (p, q <= 7); float %.2g\n", static_cast<int>(family), worst,
                    worst_large, worst_float);
        // The numerator comes from sums that cancel where many slow zeros stand beside fast poles: beyond the paper's
        // p, q <= 3 that is the limit.
        CHECK(no_zeros < 1e-13);
        CHECK(worst < 1e-9);
        CHECK(worst_large < 1e-5);
        // In delta = z - 1 roots near the Nyquist frequency (z = -1) are the badly conditioned ones, and cost digits
        // in float.
        CHECK(worst_float < (family == reference::Family::fast ? 5e-2 : 1e-4));
    }
}

TEST_CASE("held: one mass, a free integrator and a double integrator in figures") {
    const double Ts = 1e-3, K = 700.0;
    using Roots = std::vector<std::complex<double>>;
    const Delta<double> mass = held(factors_from_roots(K, Roots{-25.0}, {}), Ts);
    CHECK_NEAR(mass.a[0], -std::expm1(-25.0 * Ts), 1e-17);
    CHECK_NEAR(mass.b[1], -K * std::expm1(-25.0 * Ts) / 25.0, 1e-15);
    const Delta<double> integrator = held(factors_from_roots(K, Roots{0.0}, {}), Ts);
    CHECK(integrator.a[0] == 0.0);
    CHECK_NEAR(integrator.b[1], K * Ts, 1e-16);
    // 1/s^2: Ts^2/2 (z+1)/(z-1)^2 = (Ts^2/2) (delta + 2)/delta^2
    const Delta<double> twice = held(factors_from_roots(K, Roots{0.0, 0.0}, {}), Ts);
    CHECK(twice.a[0] == 0.0 && twice.a[1] == 0.0);
    CHECK_NEAR(twice.b[1], 0.5 * K * Ts * Ts, 1e-18);
    CHECK_NEAR(twice.b[2], K * Ts * Ts, 1e-18);
}

TEST_CASE("held: a step of torque ends at K prod B / prod A") {
    Random random(42);
    for (int repeat = 0; repeat < 300; ++repeat) {
        const std::size_t p = 1 + random.below(3), q = random.below(4);
        reference::Plant g = reference::random_plant(random, p, q, reference::Family::ordinary, 1e-3, 200);
        g.K = 3.0;
        std::complex<double> dc = g.K;
        for (const auto a : g.A1) dc /= a;
        for (std::size_t j = 0; j < q; ++j) dc *= g.B2[j] / g.A2[j];
        const Delta<double> h = held(reference::factors_of(g), 1e-3);
        CHECK_NEAR(h.b[h.order] / h.a[h.order - 1] / dc.real(), 1.0, 1e-8);
    }
}

TEST_CASE("held: roots far beyond the sampling frequency do no harm") {
    using Roots = std::vector<std::complex<double>>;
    const Factors<double> g = factors_from_roots(1e9, Roots{{-1e5, 1e6}, {-1e5, -1e6}, -20.0}, Roots{});
    const Delta<double> h = held(g, 1e-3);
    // What is left is the slow pole, a gain and nothing else.
    const double dc = 1e9 / 20.0 / (1e10 + 1e12);
    CHECK_NEAR(h.b[3] / h.a[2] / dc, 1.0, 1e-9);
    for (int i = 0; i < 3; ++i) CHECK(std::isfinite(h.a[i]) && std::isfinite(h.b[i + 1]));
}
