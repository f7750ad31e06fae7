#include "check.hpp"
#include "gaident/control/closed_loop.hpp"
#include "gaident/control/servo.hpp"
#include "gaident/control/servo_equation.hpp"
#include "gaident/plant/held.hpp"
#include "gaident/plant/roots.hpp"
#include "gaident/reference/bits.hpp"
#include "gaident/reference/drives.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>

using namespace gaident;

namespace {

Delta<double> held(const Factors<double>& g, double T) { return held_plant(g, T, held_doublings(largest_root(g), T)); }

// Steps and ramps at the lines of a log, and the part of it that goes straight from line to line.
struct Command {
    std::vector<double> line, straight;

    Command(std::size_t lines, Between between) {
        double held = 0.0, ramp = 0.0;
        for (std::size_t k = 0; k < lines; ++k) {
            if (between != Between::straight && k % 40 == 3) held = 20.0 * std::cos(0.9 * static_cast<double>(k));
            if (between != Between::held && k > 10) ramp += 0.3 * std::cos(0.05 * static_cast<double>(k));
            line.push_back(held + ramp);
            straight.push_back(ramp);
        }
    }
    // At the controller's sample n, `every` a line.
    double at(std::size_t n, int every) const {
        const auto r = static_cast<std::size_t>(every);
        const std::size_t k = std::min(n / r, line.size() - 1), next = std::min(k + 1, line.size() - 1);
        const double part = k == n / r ? static_cast<double>(n % r) / every : 0.0;
        return line[k] + part * (straight[next] - straight[k]);
    }
};

// Controller and plant in turn at the controller's clock: the velocity at the lines of the log.
std::vector<double> in_turn(const Factors<double>& g, const Loop& loop, const Clock& clock, const Feedforward& fed, int delay,
                            const Command& command) {
    const double T = clock.period;
    const Delta<double> plant = held(g, T);
    const auto every = static_cast<std::size_t>(clock.log_every), step = static_cast<std::size_t>(loop.servo.position_every);
    Servo<double> servo(loop.controller, loop.servo, T);
    std::vector<double> line, on_the_way(static_cast<std::size_t>(delay), 0.0);
    double x[max_loop_order] = {}, angle = 0.0, before = 0.0;
    for (std::size_t n = 0; n < command.line.size() * every; ++n) {
        const double w = x[0];
        if (n > 0) angle += 0.5 * T * (w + before);
        before = w;
        if (n % every == 0) line.push_back(w);
        const std::size_t place = n / step * step;
        const double source = command.at(n, clock.log_every);
        const double slope =
            (command.at(place + step, clock.log_every) - command.at(place, clock.log_every)) / (static_cast<double>(step) * T);
        const double r = servo.command(n, source, fed.velocity * slope, angle);
        const double u = servo.torque(r, w, fed.acceleration * slope);
        on_the_way.push_back(u);
        recurrence_step<double, -1>(plant.order, plant.a, plant.b, x, on_the_way.front());
        on_the_way.erase(on_the_way.begin());
    }
    return line;
}

std::vector<double> in_one_equation(const Factors<double>& g, const ServoEquation& equation, const Command& command) {
    double straight[max_loop_order + 1] = {}, x[max_loop_order] = {}, also[max_loop_order] = {};
    const Delta<double> h = equation(held(g, equation.period()), straight);
    std::vector<double> y;
    for (std::size_t k = 0; k < command.line.size(); ++k) {
        double sum = recurrence_step<double, -1>(h.order, h.a, h.b, x, command.line[k]);
        if (equation.between() == Between::mixed)
            sum += recurrence_step<double, -1>(h.order, h.a, straight, also, command.straight[k]);
        y.push_back(sum);
    }
    return y;
}

constexpr double T = 125e-6;

// A motor alone, with a load on a shaft, and with a slow pole: z = 1 - 1e-4.
const std::vector<Factors<double>>& plants() {
    using C = std::complex<double>;
    static const std::vector<Factors<double>> all = [] {
        const std::vector<C> slow{-0.8}, two{{-12.0, 400.0}, {-12.0, -400.0}, -6.0}, zeros{{-5.0, 230.0}, {-5.0, -230.0}};
        const std::vector<C> lag{-0.8, -900.0}, four{{-30.0, 1500.0}, {-30.0, -1500.0}, {-12.0, 400.0}, {-12.0, -400.0}, -0.8};
        const std::vector<C> both{{-20.0, 1200.0}, {-20.0, -1200.0}, {-5.0, 230.0}, {-5.0, -230.0}};
        return std::vector<Factors<double>>{factors_from_roots(1000.0, slow, {}), factors_from_roots(2500.0, two, zeros),
                                            factors_from_roots(9e5, lag, {}), factors_from_roots(2500.0, four, both)};
    }();
    return all;
}

Loop bare(double kp = 0.05, double ki = 2.0) {
    Loop loop;
    loop.kind = LoopKind::servo;
    loop.controller.kp = kp;
    loop.controller.ki = ki;
    return loop;
}

FilterChain chain(std::initializer_list<DigitalFilter> filters) {
    FilterChain c;
    for (const DigitalFilter& f : filters) c.filter[c.count++] = f;
    return c;
}

struct Kind {
    const char* name;
    Loop loop;
    Feedforward fed;
    int delay = 0;
};

std::vector<Kind> kinds() {
    std::vector<Kind> all;
    const auto add = [&](const char* name, const std::function<void(Kind&)>& change) {
        all.push_back({name, bare(), {}, 0});
        change(all.back());
    };
    add("bare PI", [](Kind&) {});
    add("backward", [](Kind& k) { k.loop.servo.newest = 1.0; });
    add("forward, weight 0.3", [](Kind& k) { k.loop.servo.newest = 0.0, k.loop.servo.command_weight = 0.3; });
    add("IP", [](Kind& k) { k.loop.servo.command_weight = 0.0; });
    add("torque filters", [](Kind& k) { k.loop.servo.torque_filters = chain({low_pass(2e-4, T), notch(285.0, 0.1, 0.7, T)}); });
    add("velocity filter", [](Kind& k) { k.loop.servo.velocity_filters = chain({low_pass(1e-3, T)}); });
    add("command filters", [](Kind& k) { k.loop.servo.command_filters = chain({low_pass(2e-3, T), low_pass(1e-3, T)}); });
    add("acceleration feedforward", [](Kind& k) { k.fed.acceleration = 9e-4; });
    add("delay", [](Kind& k) { k.delay = 2, k.loop.servo.delay = 2 * T; });
    add("position", [](Kind& k) { k.loop.servo.position_gain = 6.0, k.fed.velocity = 0.9; });
    add("all", [](Kind& k) {
        k.loop.servo.newest = 1.0, k.loop.servo.command_weight = 0.5, k.delay = 1, k.loop.servo.delay = T;
        k.loop.servo.torque_filters = chain({low_pass(2e-4, T), notch(285.0, 0.1, 0.7, T)});
        k.loop.servo.velocity_filters = chain({low_pass(3e-4, T)});
        k.loop.servo.command_filters = chain({low_pass(2e-3, T)});
        k.loop.servo.position_gain = 2.0, k.fed.velocity = 1.0;
    });
    return all;
}

double deviation(const std::vector<double>& x, const std::vector<double>& of) {
    double most = 0.0, size = 0.0;
    for (std::size_t i = 0; i < of.size(); ++i) {
        most = std::max(most, std::abs(x[i] - of[i]));
        size = std::max(size, std::abs(of[i]));
    }
    return most / size;
}

}  // namespace

TEST_CASE("servo_equation: every linear loop, seen at every r-th sample, equals controller and plant in turn") {
    for (const Kind& kind : kinds()) {
        double worst = 0.0;
        for (const Factors<double>& g : plants())
            for (const int every : {1, 2, 3, 4, 5, 8, 10, 16})
                for (const Between between : {Between::held, Between::straight, Between::mixed}) {
                    if (kind.fed.velocity != 0.0 && between != Between::straight) continue;  // the slope of a jump of an angle
                    const Clock clock{T, every};
                    const ServoEquation equation(kind.loop, clock, kind.fed, between);
                    const Command command(300, between);
                    const auto wanted = in_turn(g, kind.loop, clock, kind.fed, kind.delay, command);
                    CHECK(*std::max_element(wanted.begin(), wanted.end()) < 1e4);  // a stable loop
                    worst = std::max(worst, deviation(in_one_equation(g, equation, command), wanted));
                }
        std::printf("%s: %.2g\n", kind.name, worst);
        CHECK(worst < 1e-9);
    }
}

TEST_CASE("servo_equation: a position controller slower than the velocity controller") {
    for (const int slower : {2, 4, 8}) {
        Loop loop = bare();
        loop.servo.position_gain = 6.0;
        loop.servo.position_every = slower;
        const Feedforward fed{.velocity = 1.0};
        for (const Factors<double>& g : plants())
            for (const int every : {8, 16}) {
                const Clock clock{T, every};
                const Command command(300, Between::mixed);
                const auto wanted = in_turn(g, loop, clock, fed, 0, command);
                const ServoEquation equation(loop, clock, fed, Between::mixed);
                CHECK(deviation(in_one_equation(g, equation, command), wanted) < 1e-9);
            }
    }
}

TEST_CASE("servo_equation: one sample a line and a bare PI is the closed loop of the genetic search") {
    for (const Factors<double>& g : plants()) {
        const Loop loop = bare();
        const Clock clock{T, 1};
        const Delta<double> plant = held(g, T), wanted = close_loop(plant, loop.controller, clock);
        const Delta<double> h = ServoEquation(loop, clock, {}, Between::held)(plant, static_cast<double*>(nullptr));
        CHECK(h.order == wanted.order);
        for (int i = 0; i < h.order; ++i) CHECK_NEAR(h.a[i], wanted.a[i], 1e-14 * std::abs(wanted.a[i]));
        for (int i = 0; i <= h.order; ++i) CHECK_NEAR(h.b[i], wanted.b[i], 1e-14 * std::abs(wanted.b[i]));
    }
}

TEST_CASE("servo_equation: what is no linear equation is refused") {
    Loop limited = bare();
    limited.controller.torque_limit = 1.0;
    CHECK_THROWS(ServoEquation(limited, {T, 8}, {}, Between::held), std::invalid_argument);
    Loop late = bare();
    late.servo.delay = 0.5 * T;
    CHECK_THROWS(ServoEquation(late, {T, 8}, {}, Between::held), std::invalid_argument);
    for (const double samples : {16.0, 1e6, 3e9, 1e300}) {
        late.servo.delay = samples * T;
        CHECK_THROWS(ServoEquation(late, {T, 8}, {}, Between::held), std::invalid_argument);
    }
    Loop placed = bare();
    placed.servo.position_gain = 20.0;
    CHECK_THROWS(ServoEquation(placed, {T, 8}, {.acceleration = 1e-3}, Between::straight), std::invalid_argument);
    placed.servo.position_every = 3;
    CHECK_THROWS(ServoEquation(placed, {T, 8}, {}, Between::straight), std::invalid_argument);
    CHECK_THROWS(Decimation(37), std::invalid_argument);
    CHECK_THROWS(Decimation(0), std::invalid_argument);
}
