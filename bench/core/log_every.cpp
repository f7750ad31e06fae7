// What a log that has a line for every 8th sample of the controller costs the genetic search: a whole generation beside one of the
// same drive with one sample a line. The bound that is asked for is 1.5.
// Error sums are first checked against controller and plant in turn, at the controller's clock.
#include "../../csrc/gaident/control/servo.hpp"
#include "../../csrc/gaident/control/servo_equation.hpp"
#include "../../csrc/gaident/plant/roots.hpp"
#include "../../csrc/gaident/identification/velocity_objective.hpp"
#include "../../csrc/gaident/search/breeder.hpp"
#include "../require.hpp"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>

using namespace gaident;

namespace {

constexpr double Ts = 0.444e-3;
constexpr int population = 50, generations = 20;

enum class Command { step, staircase, ramps, both };
constexpr const char* command_names[] = {"step", "staircase", "ramps", "steps, ramps"};

Loop loop_of(bool servo, bool filters, double period) {
    Loop loop;
    loop.kind = servo ? LoopKind::servo : LoopKind::sampled;
    loop.controller.kp = 0.0232 * 5.5637;
    loop.controller.ki = 1.367 * 5.5637;
    if (filters) {
        loop.servo.torque_filters.filter[0] = low_pass(0.3e-3, period);
        loop.servo.torque_filters.filter[1] = notch(285.0, 0.1, 0.7, period);
        loop.servo.torque_filters.count = 2;
    }
    return loop;
}

struct Drive {
    std::vector<double> input, straight, output;
    Clock clock;
    std::unique_ptr<ServoEquation> equation;
    Experiment experiment;

    Drive(Command command, std::size_t samples, int every, bool filters)
        : input(samples), straight(samples), clock{Ts / every, every} {
        const bool servo = every > 1 || filters;
        for (std::size_t k = 0; k < samples; ++k) {
            const double x = static_cast<double>(k) / static_cast<double>(samples);
            const double jumps = command == Command::step ? 43.6 : 43.6 * static_cast<double>(1 + (4 * k / samples) % 3) - 20.0;
            straight[k] = command == Command::ramps || command == Command::both ? 40.0 * std::min(x, 1.0 - x) : 0.0;
            input[k] = (command == Command::ramps ? 0.0 : jumps) + straight[k];
        }
        experiment.loop = loop_of(servo, filters, clock.period);
        const Between between = command == Command::ramps  ? Between::straight
                                : command == Command::both ? Between::mixed
                                                           : Between::held;
        if (servo) equation = std::make_unique<ServoEquation>(experiment.loop, clock, Feedforward{}, between);
        const std::complex<double> poles[] = {-15.41, {-10.30, 150.9}, {-10.30, -150.9}};
        const std::complex<double> zeros[] = {{-4.26, 93.98}, {-4.26, -93.98}};
        output = in_turn(factors_from_roots(6545.29, poles, zeros));
        Random random(1);
        for (double& y : output) y += 0.6 * (random.uniform() + random.uniform() + random.uniform() - 1.5);
        Record record;
        record.input = input;
        record.output = output;
        record.sample_time = Ts;
        record.servo = equation.get();
        if (servo && between == Between::mixed) record.straight = straight;
        experiment.records.push_back(record);
    }

    // The velocity at the lines; with one sample a line the command is held.
    std::vector<double> in_turn(const Factors<double>& g) const {
        const Delta<double> plant = held_plant(g, clock.period, held_doublings(largest_root(g), clock.period));
        Servo<double> servo(experiment.loop.controller, experiment.loop.servo, clock.period);
        const auto every = static_cast<std::size_t>(clock.log_every);
        std::vector<double> line;
        double x[max_loop_order] = {};
        for (std::size_t n = 0; n < every * input.size(); ++n) {
            const std::size_t k = n / every, next = std::min(k + 1, input.size() - 1);
            if (n % every == 0) line.push_back(x[0]);
            const double part = static_cast<double>(n % every) / static_cast<double>(every);
            const double u =
                servo.torque(servo.command(n, input[k] + part * (straight[next] - straight[k]), 0.0, 0.0), x[0], 0.0);
            recurrence_step<double, -1>(plant.order, plant.a, plant.b, x, u);
        }
        return line;
    }
};

class Generations {
public:
    explicit Generations(const Drive& drive) : drive_(drive), objective_(drive.experiment, ranges(), settings()) {
        Breeder breeder = start(0);
        for (std::size_t i = 0; i < population; i += 7) {
            const Factors<double> g = objective_.factors(breeder[i]);
            const std::vector<double> y = drive.in_turn(g);
            double sum = 0.0, size = 0.0;
            for (std::size_t k = 0; k < y.size(); ++k) {
                const double wanted = drive.output[k];
                sum += (wanted - y[k]) * (wanted - y[k]);
                size += wanted * wanted + y[k] * y[k];
            }
            const double found = breeder.cost(i) - 2.0 * g.structure.poles();
            if (sum < 1e10) require(std::abs(found - sum) <= 1e-9 * size, "log_every");  // not where it diverges
        }
    }

    // Seconds of one generation.
    double time(int runs) const {
        std::clock_t ticks = 0;
        const Breeder::Group all[] = {{0, population, 0, false}};
        for (int run = 0; run < runs; ++run) {
            Breeder breeder = start(run);
            const std::clock_t begin = std::clock();
            for (int g = 0; g < generations; ++g) breeder.generation(all);
            ticks += std::clock() - begin;
        }
        return static_cast<double>(ticks) / CLOCKS_PER_SEC / runs / generations;
    }

private:
    static SearchRanges ranges() {
        SearchRanges r;
        r.p_min = 1;
        return r;
    }
    static PlantSettings settings() {
        PlantSettings s;
        s.population = population;
        return s;
    }
    Breeder start(int run) const {
        Breeder breeder(objective_, settings(), Random(static_cast<std::uint64_t>(3 + run)), drive_.experiment.kernels->words);
        breeder.randomise(0, population);
        breeder.evaluate();
        return breeder;
    }

    const Drive& drive_;
    VelocityObjective objective_;
};

}  // namespace

void log_every_rows(bool quick) {
    std::printf("\nA generation of %d candidates with a log of every 8th sample of the controller, beside one of every sample\n",
                population);
    std::printf("%-12s %8s %-16s | us/generation: 1, 8 | ratio\n", "command", "samples", "controller");
    for (const Command command : {Command::step, Command::staircase, Command::ramps, Command::both})
        for (const std::size_t samples : {250UL, 1000UL, 4000UL})
            for (const bool filters : {false, true}) {
                // With one sample a line a ramp is held from line to line: another record, of the same work.
                const Drive one(command, samples, 1, filters), eight(command, samples, 8, filters);
                const Generations of_one(one), of_eight(eight);
                std::vector<double> ones, eights;
                for (int repetition = 0; repetition < (quick ? 3 : 11); ++repetition) {  // in turn: the machine's load changes
                    const int runs = static_cast<int>(1 + (quick ? 1000 : 4000) / samples);
                    ones.push_back(of_one.time(runs));
                    eights.push_back(of_eight.time(runs));
                }
                std::sort(ones.begin(), ones.end());
                std::sort(eights.begin(), eights.end());
                const double a = ones[ones.size() / 2], b = eights[eights.size() / 2];
                std::printf("%-12s %8zu %-16s | %9.2f %9.2f | %5.2f\n", command_names[static_cast<int>(command)], samples,
                            filters ? "PI, two filters" : "bare PI", a * 1e6, b * 1e6, b / a);
            }
}
