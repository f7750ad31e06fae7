#include "check.hpp"
#include "gaident/reference/drives.hpp"
#include "gaident/simulation/simulate.hpp"

using namespace gaident;

TEST_CASE("simulate: velocity and torque in every loop, in double and in float") {
    Random random(101);
    double velocity = 0.0, torque = 0.0, in_float = 0.0;
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open})
        for (int repeat = 0; repeat < 800; ++repeat) {
            const std::size_t p = (kind == LoopKind::continuous ? 0 : 1) + random.below(3), q = random.below(4);
            const auto family = reference::families[repeat % 4];
            auto d = reference::random_drive(random, kind, p, q, family, 200);
            if (repeat % 3 == 0 && kind != LoopKind::open) {
                const auto u = d.respond<double>().torque;
                d.loop.controller.torque_limit = 0.7 * reference::deviation(u, std::vector<double>(u.size(), 0.0));
            }
            const auto exact = d.respond<long double>();
            if (reference::deviation(d.respond<double>().velocity, exact.velocity) > 1e-12) continue;
            std::vector<double> w(200), u(200);
            simulate<double>(d.factors(), d.input, d.sample_time, d.loop, nullptr, w, u);
            velocity = std::max(velocity, reference::deviation(w, exact.velocity));
            torque = std::max(torque, reference::deviation(u, exact.torque));
            simulate_in_float(d.factors(), d.input, d.sample_time, d.loop, nullptr, w, u);
            in_float = std::max(in_float, reference::deviation(w, exact.velocity));
        }
    std::printf("velocity %.2g, torque %.2g, velocity in float %.2g\n", velocity, torque, in_float);
    CHECK(velocity < 1e-9);
    CHECK(torque < 1e-9);
    CHECK(in_float < 1e-4);
}

TEST_CASE("simulate: a record cut in two goes on from the state where it was cut") {
    // Free response in open loop: the state is defined by (z-1) x[0] ... in the difference equation itself.
    const auto d = reference::paper_drive(true);
    Loop open = d.loop;
    open.kind = LoopKind::open;
    Random random(102);
    const std::vector<double> torque = reference::random_signal(random, 300);
    std::vector<double> w(300), u(300);
    simulate<double>(d.factors(), torque, d.sample_time, open, nullptr, w, u);
    const Delta<double> plant = plant_of(d.factors(), open, d.sample_time);
    double x[max_loop_order] = {};
    for (std::size_t i = 0; i < 120; ++i) recurrence_step<double, -1>(plant.order, plant.a, plant.b, x, torque[i]);
    std::vector<double> rest(180), unused(180);
    simulate<double>(d.factors(), std::span(torque).subspan(120), d.sample_time, open, x, rest, unused);
    for (std::size_t i = 0; i < 180; ++i) CHECK(rest[i] == w[120 + i]);
}

TEST_CASE("simulate: a long record, run in parts, is that of one run, and ends where it is asked to") {
    const std::size_t n = 2 * samples_between_stops + 77;
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open})
        for (const double limit : {0.05, 0.5, 5.0, 1e300}) {  // the smallest always acts, the largest never
            auto d = reference::paper_drive(true);
            d.loop.kind = kind;
            if (limit < 1e300 && kind != LoopKind::open) d.loop.controller.torque_limit = limit;
            Random random(103);
            const std::vector<double> input = reference::random_signal(random, n);
            std::vector<double> w(n), u(n), whole(n), torque(n);
            simulate<double>(d.factors(), input, d.sample_time, d.loop, nullptr, w, u);
            Record record;
            record.input = record.output = input;
            record.sample_time = d.sample_time;
            const Prepared c = prepare(d.factors(), record, d.loop, nullptr);
            AloneRun<double> run{kind, d.loop.limited(), c.response.order, {}, {}, {}, {d.loop.controller, Clock{d.sample_time}}};
            std::copy(c.response.a, c.response.a + run.order, run.a);
            std::copy(c.response.b, c.response.b + run.order + 1, run.b);
            best_kernels().in_double.alone(run, input.data(), n, whole.data(), torque.data());
            CHECK(w == whole && u == torque);
            for (const bool asked : {false, true}) {
                const std::atomic<bool> stop{asked};
                const auto again = [&] { simulate<double>(d.factors(), input, d.sample_time, d.loop, nullptr, w, u, &stop); };
                const auto in_float = [&] { simulate_in_float(d.factors(), input, d.sample_time, d.loop, nullptr, w, u, &stop); };
                if (asked) {
                    CHECK_THROWS(again(), Stopped);
                    CHECK_THROWS(in_float(), Stopped);
                } else {
                    again();
                    CHECK(w == whole);
                }
            }
        }
}

TEST_CASE("simulate: Table V from Table IV in powers of z") {
    const auto check = [](bool two_mass, std::vector<double> alpha, std::vector<double> beta, double tolerance) {
        const auto d = reference::paper_drive(two_mass);
        const Delta<double> h = close_loop(plant_of(d.factors(), d.loop, d.sample_time), d.loop.controller, Clock{d.sample_time});
        double a[max_loop_order + 1], b[max_loop_order];
        powers_of_z(h, a, b);
        for (std::size_t i = 0; i < alpha.size(); ++i) CHECK_NEAR(a[i], alpha[i], tolerance);
        for (std::size_t i = 0; i < beta.size(); ++i) CHECK_NEAR(b[i], beta[i], 1e-5);
    };
    check(false, {0.051627, 0.0013332, -0.0502938}, {1.88115, -0.88382}, 1e-6);
    check(true, {0.158765, -0.312555, -0.004676, 0.312562, -0.154081}, {3.66034, -4.99511, 3.00858, -0.67382}, 2e-6);
}

TEST_CASE("simulate: equation (7), run as it is printed, gives the same velocity") {
    const auto d = reference::paper_drive(true);
    const Delta<double> h = close_loop(plant_of(d.factors(), d.loop, d.sample_time), d.loop.controller, Clock{d.sample_time});
    double alpha[max_loop_order + 1], beta[max_loop_order];
    powers_of_z(h, alpha, beta);
    std::vector<double> w, exact(250), u(250);
    for (std::size_t n = 0; n < 250; ++n) {
        double sum = 0.0;
        for (std::size_t i = 0; i <= 4 && i <= n; ++i) sum += alpha[i] * d.input[n - i];
        for (std::size_t i = 1; i <= 4 && i <= n; ++i) sum += beta[i - 1] * w[n - i];
        w.push_back(sum);
    }
    simulate<double>(d.factors(), d.input, d.sample_time, d.loop, nullptr, exact, u);
    CHECK(reference::deviation(w, exact) < 1e-9);
}
