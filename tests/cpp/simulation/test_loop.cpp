#include "check.hpp"
#include "gaident/simulation/batch.hpp"
#include "gaident/numeric/float_pair.hpp"
#include "gaident/reference/drives.hpp"

using namespace gaident;

namespace {

// The stepped loop from a given state of plant and controller.
template <class R>
reference::Response<double> stepped(const reference::Drive& d, const double* start = nullptr) {
    const Delta<double> plant = plant_of(d.factors(), d.loop, d.sample_time);
    R a[max_loop_order], b[max_loop_order + 1], x[max_loop_order] = {};
    for (int i = 0; i < plant.order; ++i) a[i] = static_cast<R>(plant.a[i]);
    for (int i = 0; i <= plant.order; ++i) b[i] = static_cast<R>(plant.b[i]);
    SteppedLoop<R, -1> loop{ControllerState<R>(d.loop.controller, Clock{d.sample_time})};
    if (start != nullptr) {
        for (int i = 0; i < plant.order; ++i) x[i] = static_cast<R>(start[i]);
        loop.pi.s = static_cast<R>(start[plant.order]);
    }
    reference::Response<double> out;
    for (const double r : d.input) {
        R u;
        out.velocity.push_back(static_cast<double>(loop.step(plant.order, a, b, x, static_cast<R>(r), u)));
        out.torque.push_back(static_cast<double>(u));
    }
    return out;
}

struct Worst {
    double velocity = 0.0, torque = 0.0, in_pairs = 0.0;
    int used = 0, skipped = 0;
    void note(const reference::Drive& d, bool with_pairs) {
        const auto exact = d.respond<long double>();
        // A saturated loop can multiply the last digit's rounding without end; the referee in double tells where.
        const double own = reference::deviation(d.respond<double>().velocity, exact.velocity);
        if (own > 1e-12) {
            ++skipped;
            return;
        }
        ++used;
        with_pairs = with_pairs && own < 1e-13;
        const auto found = stepped<double>(d);
        velocity = std::max(velocity, reference::deviation(found.velocity, exact.velocity));
        torque = std::max(torque, reference::deviation(found.torque, exact.torque));
        if (with_pairs) in_pairs = std::max(in_pairs, reference::deviation(stepped<FloatPair>(d).velocity, exact.velocity));
    }
    void report(const char* what) const {
        CHECK(skipped * 4 < used);
        std::printf("%s: velocity %.2g, torque %.2g, velocity in pairs of floats %.2g (%d drives)\n", what, velocity, torque,
                    in_pairs, used);
        CHECK(velocity < 1e-9);
        CHECK(torque < 1e-9);
        CHECK(in_pairs < 1e-4);
    }
};

template <class Change>
void compare(const char* what, LoopKind kind, std::uint64_t seed, Change&& change) {
    Random random(seed);
    for (const auto family : reference::families) {
        Worst worst;
        for (std::size_t p = kind == LoopKind::continuous ? 0 : 1; p <= 4; ++p)
            for (std::size_t q = 0; q <= 4; ++q)
                for (int repeat = 0; repeat < 6; ++repeat) {
                    auto d = reference::random_drive(random, kind, p, q, family, 250);
                    change(d, random);
                    worst.note(d, p <= 3 && q <= 3);
                }
        worst.report(what);
    }
}

double largest_torque(const reference::Drive& d) {
    const auto u = d.respond<double>().torque;
    return reference::deviation(u, std::vector<double>(u.size(), 0.0));
}

}  // namespace

TEST_CASE("loop: without a reached limit the stepped loop is the linear one") {
    const auto nothing = [](reference::Drive&, Random&) {};
    compare("continuous", LoopKind::continuous, 61, nothing);
    compare("sampled", LoopKind::sampled, 62, nothing);
}

TEST_CASE("loop: limits of torque and integrator, as the referee's cases have them") {
    const auto limits = [](reference::Drive& d, Random& random) {
        const double largest = largest_torque(d);
        if (random.below(3) != 0) d.loop.controller.torque_limit = largest * reference::uniform(random, 0.1, 0.9);
        if (random.below(3) != 0) d.loop.controller.integrator_limit = largest * reference::uniform(random, 0.05, 0.9);
    };
    compare("continuous, limited", LoopKind::continuous, 63, limits);
    compare("sampled, limited", LoopKind::sampled, 64, limits);
}

TEST_CASE("loop: the torque obeys the controller's own equation in every sample") {
    Random random(65);
    for (int repeat = 0; repeat < 200; ++repeat) {
        auto d = reference::random_drive(random, LoopKind::continuous, random.below(4), random.below(4),
                                         reference::Family::ordinary, 150);
        const double largest = largest_torque(d);
        d.loop.controller.torque_limit = 0.5 * largest;
        d.loop.controller.integrator_limit = 0.3 * largest;
        const auto out = stepped<double>(d);
        double I = 0.0, before = 0.0;
        for (std::size_t i = 0; i < d.input.size(); ++i) {
            const double e = d.input[i] - out.velocity[i];
            I = clamp(I + 0.5 * d.loop.controller.ki * d.sample_time * (e + before), -d.loop.controller.integrator_limit,
                      d.loop.controller.integrator_limit);
            before = e;
            CHECK_NEAR(out.torque[i],
                       clamp(d.loop.controller.kp * e + I, -d.loop.controller.torque_limit, d.loop.controller.torque_limit),
                       1e-10 * largest);
        }
    }
}

TEST_CASE("loop: any start state gives the same response as the one difference equation") {
    Random random(66);
    double worst = 0.0;
    for (int repeat = 0; repeat < 600; ++repeat) {
        const auto kind = repeat % 2 == 0 ? LoopKind::continuous : LoopKind::sampled;
        const std::size_t p = (repeat % 2 == 0 ? 0 : 1) + random.below(3), q = random.below(4);
        const auto d = reference::random_drive(random, kind, p, q, reference::families[random.below(4)], 200);
        // A state of the size that the response has anyway: what the plant holds after a while.
        const Delta<double> plant = plant_of(d.factors(), d.loop, d.sample_time);
        double start[max_loop_order + 1] = {}, unused;
        SteppedLoop<double, -1> warm{ControllerState<double>(d.loop.controller, Clock{d.sample_time})};
        for (std::size_t i = 0; i < 20; ++i) warm.step(plant.order, plant.a, plant.b, start, d.input[i], unused);
        start[plant.order] = warm.pi.s;
        const Record record = [&] {
            Record r;
            r.input = r.output = d.input;
            r.sample_time = d.sample_time;
            return r;
        }();
        Prepared c = prepare(d.factors(), record, d.loop, start);
        std::vector<double> y;
        for (const double r : d.input)
            y.push_back(recurrence_step<double, -1>(c.response.order, c.response.a, c.response.b, c.x, r));
        worst = std::max(worst, reference::deviation(y, stepped<double>(d, start).velocity));
    }
    std::printf("start states: %.2g\n", worst);
    CHECK(worst < 1e-9);
}
