#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/control/closed_loop.hpp"
#include "gaident/numeric/float_pair.hpp"

using namespace gaident;

namespace {

Delta<double> closed(const reference::Drive& d) {
    return close_loop(plant_of(d.factors(), d.loop, d.sample_time), d.loop.controller, Clock{d.sample_time});
}

void compare(LoopKind kind, std::uint64_t seed) {
    Random random(seed);
    for (const auto family : reference::families) {
        double paper = 0.0, large = 0.0, in_float = 0.0, in_pairs = 0.0;
        int plain = 0, all = 0;
        for (std::size_t p = kind == LoopKind::continuous ? 0 : 1; p <= 7; ++p)
            for (std::size_t q = 0; q <= 7; ++q)
                for (int repeat = 0; repeat < (p <= 3 && q <= 3 ? 12 : 3); ++repeat) {
                    const auto d = reference::random_drive(random, kind, p, q, family, 250);
                    const Delta<double> h = closed(d);
                    CHECK(h.order == static_cast<int>(p + q) + 1);
                    const auto exact = d.respond<long double>().velocity;
                    double& worst = p <= 3 && q <= 3 ? paper : large;
                    worst = std::max(worst, reference::deviation(outputs<double>(h, d.input), exact));
                    if (p > 3 || q > 3) continue;
                    ++all;
                    in_pairs = std::max(in_pairs, reference::deviation(outputs<FloatPair>(h, d.input), exact));
                    if (!float_suffices(h.order, [&](int i) { return h.a[i]; })) continue;
                    ++plain;
                    in_float = std::max(in_float, reference::deviation(outputs<float>(h, d.input), exact));
                }
        std::printf("family %d: double %.2g (p, q <= 3), %.2g (p, q <= 7); float %.2g (%d of %d), pairs of floats %.2g\n",
                    static_cast<int>(family), paper, large, in_float, plain, all, in_pairs);
        CHECK(paper < 1e-9);
        CHECK(large < (kind == LoopKind::sampled ? 1e-5 : 1e-9));  // see test_held.cpp for the held plant's own limit
        CHECK(in_float < 1e-4);
        CHECK(in_pairs < 1e-7);
        CHECK(family == reference::Family::fast || plain > all * 3 / 4);
    }
}

}  // namespace

TEST_CASE("closed_loop: continuous, one difference equation equals the cascade of modules") { compare(LoopKind::continuous, 51); }

TEST_CASE("closed_loop: sampled, one difference equation equals plant and digital controller") { compare(LoopKind::sampled, 52); }

// One line of the paper's Table V as docs/paper.md has it: with one scalar on the loop gain all coefficients
// are met.
TEST_CASE("closed_loop: Table V from Table IV") {
    const auto in_z = [](const Delta<double>& h, std::vector<double>& alpha, std::vector<double>& beta) {
        // prod (delta - ...) in z: substitute delta = z - 1 by Horner
        const auto expand = [&](std::vector<double> c) {
            std::vector<double> sum{c[0]};
            for (std::size_t i = 1; i < c.size(); ++i) {
                sum.push_back(0.0);
                for (std::size_t k = sum.size() - 1; k > 0; --k) sum[k] -= sum[k - 1];
                sum.back() += c[i];
            }
            return sum;
        };
        std::vector<double> d{1.0};
        d.insert(d.end(), h.a, h.a + h.order);
        alpha = expand(std::vector<double>(h.b, h.b + h.order + 1));
        beta = expand(d);
        beta.erase(beta.begin());
        for (double& b : beta) b = -b;
    };
    const auto close = [](const std::vector<double>& found, const std::vector<double>& printed, double tolerance) {
        CHECK(found.size() == printed.size());
        for (std::size_t i = 0; i < printed.size(); ++i) CHECK_NEAR(found[i], printed[i], tolerance);
    };
    std::vector<double> alpha, beta;
    in_z(closed(reference::paper_drive(false)), alpha, beta);
    close(alpha, {0.051627, 0.0013332, -0.0502938}, 1e-6);
    close(beta, {1.88115, -0.88382}, 1e-5);
    in_z(closed(reference::paper_drive(true)), alpha, beta);
    close(alpha, {0.158765, -0.312555, -0.004676, 0.312562, -0.154081}, 2e-6);
    close(beta, {3.66034, -4.99511, 3.00858, -0.67382}, 1e-5);
}

TEST_CASE("closed_loop: the algebraic loop divides by 1 + b0 (kp + ki Ts/2)") {
    Delta<double> gain_only;  // G = 4: y = 4 u, u = kp e + I
    gain_only.b[0] = 4.0;
    const Delta<double> h = close_loop(gain_only, Controller{.kp = 0.5, .ki = 100.0}, Clock{1e-3});
    CHECK(h.order == 1);
    const double lead = 1.0 + 4.0 * 0.55;
    CHECK_NEAR(h.b[0], 4.0 * 0.55 / lead, 1e-16);
    CHECK_NEAR(h.b[1], 4.0 * 0.1 / lead, 1e-16);
    CHECK_NEAR(h.a[0], 4.0 * 0.1 / lead, 1e-16);
}

TEST_CASE("closed_loop: steady motion stays steady") {
    Random random(53);
    for (int repeat = 0; repeat < 300; ++repeat) {
        const std::size_t p = 1 + random.below(3), q = random.below(4);
        const auto d = reference::random_drive(random, LoopKind::continuous, p, q, reference::Family::ordinary, 100);
        const Delta<double> plant = plant_of(d.factors(), d.loop, d.sample_time);
        const double y0 = 17.0, u0 = y0 * plant.a[plant.order - 1] / plant.b[plant.order];
        double x[max_loop_order];
        steady_state(plant, y0, u0, x);
        for (int i = 0; i < 50; ++i)
            CHECK_NEAR((recurrence_step<double, -1>(plant.order, plant.a, plant.b, x, u0)), y0, 1e-9 * y0);
    }
}
