// Times the core without Python: us per generation beside the bound that the machine sets, ns per candidate and sample, us per
// candidate; per arithmetic, instruction set, population, record length and loop.
// Every row first checks its answer against the referee.
// Times are of this process's own processor time, which on a shared machine is steadier than the clock on the wall.
// `--quick`: fewer repetitions.
#include "../csrc/gaident/genetic/decode.hpp"
#include "../csrc/gaident/numeric/denormals.hpp"
#include "../csrc/gaident/identification/velocity_objective.hpp"
#include "../csrc/gaident/search/breeder.hpp"
#include "../csrc/gaident/reference/cascade.hpp"
#include "../csrc/gaident/simulation/simulate.hpp"
#include "issue_rate.hpp"
#include "require.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

using namespace gaident;

void effect_rows(bool quick);     // effects.cpp
void log_every_rows(bool quick);  // core/log_every.cpp

namespace {

constexpr double Ts = 0.444e-3, kp = 0.0232 * 5.5637, ki = 1.367 * 5.5637;
bool quick = false;

struct Figures {
    double median, lowest, highest;
};

Figures figures(std::vector<double> runs) {
    std::sort(runs.begin(), runs.end());
    return {runs[runs.size() / 2], runs.front(), runs.back()};
}

double seconds_of(std::clock_t ticks) { return static_cast<double>(ticks) / CLOCKS_PER_SEC; }

int repetitions() { return quick ? 3 : 11; }

// Seconds per call: median, minimum and maximum over repetitions of about 20 ms each.
template <class F>
Figures time_of(F&& call) {
    call();
    const std::clock_t begin = std::clock();
    std::size_t calls = 0;
    while (std::clock() - begin < CLOCKS_PER_SEC / 500) {
        call();
        ++calls;
    }
    const std::size_t count = quick ? calls : 10 * calls;
    std::vector<double> runs;
    for (int r = 0; r < repetitions(); ++r) {
        const std::clock_t start = std::clock();
        for (std::size_t i = 0; i < count; ++i) call();
        runs.push_back(seconds_of(std::clock() - start) / static_cast<double>(count));
    }
    return figures(std::move(runs));
}

SearchRanges paper_ranges() { return {}; }

// A two-mass record as in the paper: a step; a staircase, which is neither constant nor at rest; or the step in two records.
enum class Task { step, staircase, two_records };
constexpr const char* task_names[] = {"step", "staircase", "two records"};

struct Data {
    std::vector<double> input, output;
    Experiment experiment;

    Data(std::size_t samples, LoopKind kind, Task task) : input(samples), output(samples) {
        for (std::size_t i = 0; i < samples; ++i)
            input[i] = task == Task::staircase ? 43.6 * static_cast<double>(1 + (4 * i / samples) % 3) - 20.0 : 43.6;
        const std::complex<double> poles[] = {-15.41, {-10.30, 150.9}, {-10.30, -150.9}};
        const std::complex<double> zeros[] = {{-4.26, 93.98}, {-4.26, -93.98}};
        experiment.loop.kind = kind;
        experiment.loop.controller.kp = kp;
        experiment.loop.controller.ki = ki;
        const std::size_t parts = task == Task::two_records ? 2 : 1, n = samples / parts;
        Random random(1);
        for (std::size_t part = 0; part < parts; ++part) {
            const std::span<double> in = std::span(input).subspan(part * n, n), out = std::span(output).subspan(part * n, n);
            std::vector<double> torque(n);
            simulate<double>(factors_from_roots(6545.29, poles, zeros), in, Ts, experiment.loop, nullptr, out, torque);
            for (double& y : out) y += 0.6 * (random.uniform() + random.uniform() + random.uniform() - 1.5);
            experiment.records.push_back({in, out, Ts, Start::rest, 0.0});
        }
    }
};

std::vector<Factors<double>> candidates(std::size_t count, int p, int q) {
    SearchRanges ranges = paper_ranges();
    if (p > 3 || q > 3) ranges.p_max = ranges.q_max = 7;
    const Genome genome(ranges, Code::binary, Scale::linear);
    Population population(count, genome.words());
    Random random(7);
    random.words(population.flat().data(), population.flat().size());
    std::vector<Factors<double>> all;
    for (std::size_t i = 0; i < count; ++i) {
        genome.set_structure(population[i], p, q);
        all.push_back(decode(population[i], genome));
    }
    return all;
}

// The referee's chain of modules for a model that is at hand as factors.
reference::System<double> chain_of(const Factors<double>& g) {
    reference::System<double> chain{g.gain, {}};
    const Structure s = g.structure;
    const int pairs = s.pole_pairs(), zero_pairs = s.zero_pairs();
    for (int i = 0; i < pairs; ++i) {
        std::array<double, 3> n{0.0, 0.0, 1.0};
        if (i < zero_pairs) n = {1.0, g.zero_pair[i].e1, g.zero_pair[i].e0};
        else if (i == zero_pairs && s.single_zero() && !s.single_pole()) n = {0.0, 1.0, g.zero};
        chain.modules.push_back({2, n, {1.0, g.pole_pair[i].e1, g.pole_pair[i].e0}});
    }
    if (s.single_pole()) {
        std::array<double, 3> n{0.0, 1.0, 0.0};
        if (s.single_zero()) n = {1.0, g.zero, 0.0};
        chain.modules.push_back({1, n, {1.0, g.pole, 0.0}});
    }
    return chain;
}

// The error sums of a batch are the referee's.
void check_batch(const Data& data, std::span<const Factors<double>> all, std::span<const double> sums, double tolerance,
                 const char* what) {
    if (data.input.size() > 25000) return;  // the referee takes its time; shorter rows have checked the same code
    for (std::size_t i = 0; i < all.size(); i += all.size() / 7 + 1) {
        double sum = 0.0, size = 0.0;
        for (const Record& r : data.experiment.records) {
            const std::vector<double> y = reference::run(chain_of(all[i]), r.input, Ts, data.experiment.loop).velocity;
            for (std::size_t k = 0; k < y.size(); ++k) {
                sum += (r.output[k] - y[k]) * (r.output[k] - y[k]);
                size += r.output[k] * r.output[k] + y[k] * y[k];
            }
        }
        if (sum < 1e10) require(std::abs(sums[i] - sum) <= tolerance * size, what);  // not where it diverges
    }
}

void simulation_rows() {
    std::printf("\nSimulation of a batch (decode excluded, coefficients included), 48 candidates of one structure\n");
    std::printf("%-9s %-7s %-11s %5s %8s | ns/candidate/sample: median [min, max] | us/candidate\n", "set", "number", "loop",
                "order", "samples");
    for (const char* set : {"baseline", "avx2", "avx512"}) {
        const Kernels* kernels = kernels_named(set);
        if (kernels == nullptr) continue;
        for (const bool in_float : {false, true})
            for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled})
                for (const auto& [p, q] : {std::pair{1, 0}, {1, 2}, {3, 3}}) {
                    Data data(250, kind, Task::step);
                    data.experiment.kernels = kernels;
                    const auto all = candidates(48, p, q);
                    std::vector<double> sums(all.size());
                    Batch batch(data.experiment, all.size(), in_float);
                    batch.errors(all, sums);
                    check_batch(data, all, sums, in_float ? 1e-4 : 1e-9, "batch");
                    const Figures t = time_of([&] { batch.errors(all, sums); });
                    const double each = 1e9 / (48.0 * 250.0);
                    std::printf("%-9s %-7s %-11s %5d %8d | %8.3f [%.3f, %.3f] | %8.3f\n", set, in_float ? "float" : "double",
                                kind == LoopKind::continuous ? "continuous" : "sampled", 1 + p + q, 250, t.median * each,
                                t.lowest * each, t.highest * each, t.median * 1e6 / 48.0);
                }
    }
}

void referee_row() {
    Data data(250, LoopKind::continuous, Task::step);
    const auto all = candidates(8, 3, 3);
    std::vector<double> y(250), u(250), r(250);
    const Figures t = time_of([&] { simulate<double>(all[0], data.input, Ts, data.experiment.loop, nullptr, y, u); });
    std::printf("\nOne candidate, scalar, order 7, with torque: %.3f ns per sample [%.3f, %.3f]\n", t.median * 4e6,
                t.lowest * 4e6, t.highest * 4e6);
}

// What the sample loop of one generation has to do, in operations per number: a register of W candidates of largest order N
// costs, per sample, N + 1 fused products and sums and N additions (constant command) or 2 N + 2 and N (any).
// Sorted by order, as they are run. A fused one is issued at the rate of a multiplication.
struct Work {
    double multiply = 0.0, add = 0.0;
    // Seconds at the machine's issue rate: the additions alone, the multiplications alone, or all of them.
    double bound(const IssueRate& r) const { return std::max({add / r.add, multiply / r.multiply, (add + multiply) / r.both}); }
};

Work work_of(const VelocityObjective& objective, const Breeder& breeder, const Data& data, std::size_t lanes, bool constant) {
    std::vector<int> orders;
    for (std::size_t i = 0; i < breeder.population().size(); ++i)
        orders.push_back(1 + objective.factors(breeder[i]).structure.poles());
    std::sort(orders.begin(), orders.end());
    Work w;
    const double numbers = static_cast<double>(lanes * data.input.size());
    for (std::size_t last = lanes - 1; last < orders.size() + lanes - 1; last += lanes) {
        const double N = orders[std::min(last, orders.size() - 1)];
        w.multiply += numbers * (constant ? N + 1 : 2 * N + 2);
        w.add += numbers * N;
    }
    return w;
}

struct Instructions {
    const Kernels* kernels;
    std::size_t register_bytes;
    IssueRate in_double, in_float;
};

// The instruction sets that this machine can run.
std::vector<Instructions> instruction_sets() {
    std::vector<Instructions> all;
    all.push_back({&baseline_kernels(), 16, issue_rate_baseline(false), issue_rate_baseline(true)});
#ifdef GAIDENT_HAVE_X86_KERNELS
    if (const Kernels* k = kernels_named("avx2")) all.push_back({k, 32, issue_rate_avx2(false), issue_rate_avx2(true)});
    if (const Kernels* k = kernels_named("avx512")) all.push_back({k, 64, issue_rate_avx512(false), issue_rate_avx512(true)});
#endif
    return all;
}

// Runs of `generations` from a random population, as the paper runs 1000; the time of one generation.
// A short run holds every structure p, q <= 3, a long one mostly the winner's.
void generation_row(const Instructions& set, bool in_float, int population, std::size_t samples, LoopKind kind, Task task,
                    int generations) {
    Data data(samples, kind, task);
    data.experiment.kernels = set.kernels;
    SearchRanges ranges = paper_ranges();
    if (kind != LoopKind::continuous) ranges.p_min = 1;
    PlantSettings settings;
    settings.population = population;
    settings.in_float = in_float;
    const VelocityObjective objective(data.experiment, ranges, settings);
    const auto n = static_cast<std::size_t>(population);
    const Breeder::Group all[] = {{0, static_cast<std::uint32_t>(population), 0, false}};
    const auto start = [&](int run) {
        Breeder breeder(objective, settings, Random(static_cast<std::uint64_t>(3 + run)), set.kernels->words);
        breeder.randomise(0, n);
        breeder.evaluate();
        return breeder;
    };

    // What there is to do, over one run, and whether it is done right.
    Breeder first = start(0);
    std::vector<Factors<double>> now;
    std::vector<double> sums(n);
    for (std::size_t i = 0; i < n; ++i) {
        now.push_back(objective.factors(first[i]));
        sums[i] = first.cost(i) - 2.0 * now[i].structure.poles();
    }
    check_batch(data, now, sums, in_float ? 1e-4 : 1e-9, "generation");
    const std::size_t lanes = set.register_bytes / (in_float ? sizeof(float) : sizeof(double));
    double bound = 0.0, order = 0.0;
    for (int g = 0; g < generations; ++g) {
        first.generation(all);
        bound += work_of(objective, first, data, lanes, task != Task::staircase).bound(in_float ? set.in_float : set.in_double) /
                 generations;
        for (std::size_t i = 0; i < n; ++i)
            order += (1 + objective.factors(first[i]).structure.poles()) / static_cast<double>(n) / generations;
    }

    std::vector<double> runs;
    const int at_once =
        std::max(1, (quick ? 200 : 2000) / generations / (1 + population / 100) / (1 + static_cast<int>(samples / 500)));
    for (int r = 0; r < repetitions(); ++r) {
        double seconds = 0.0;
        for (int k = 0; k < at_once; ++k) {
            Breeder breeder = start(k);
            const std::clock_t begin = std::clock();
            for (int g = 0; g < generations; ++g) breeder.generation(all);
            seconds += seconds_of(std::clock() - begin);
        }
        runs.push_back(seconds / at_once / generations);
    }
    const Figures t = figures(std::move(runs));
    std::printf("%-9s %-7s %-11s %-12s %6d %8zu %6d | %9.2f [%.2f, %.2f] | %6.1f | %5.2f | %8.2f | %5.2f\n", set.kernels->name,
                in_float ? "float" : "double", kind == LoopKind::continuous ? "continuous" : "sampled",
                task_names[static_cast<int>(task)], population, samples, generations, t.median * 1e6, t.lowest * 1e6,
                t.highest * 1e6, t.median * 1e12 / (static_cast<double>(population) * static_cast<double>(samples)), order,
                bound * 1e6, t.median / bound);
}

void generation_rows() {
    const std::vector<Instructions> sets = instruction_sets();
    std::printf("\nIssue rates, 1e9 per second: multiplications, additions, half and half\n");
    for (const Instructions& s : sets)
        std::printf("%-9s double %.1f, %.1f, %.1f   float %.1f, %.1f, %.1f\n", s.kernels->name, s.in_double.multiply * 1e-9,
                    s.in_double.add * 1e-9, s.in_double.both * 1e-9, s.in_float.multiply * 1e-9, s.in_float.add * 1e-9,
                    s.in_float.both * 1e-9);
    std::printf(
        "\nA whole generation (decode, discretise, simulate, select, cross, mutate), 194 bits; bound: the sample loop's "
        "operations at those rates\n");
    std::printf(
        "%-9s %-7s %-11s %-12s %6s %8s %6s | us/generation: median [min, max] | ps/candidate/sample | mean order | bound us | "
        "ratio\n",
        "set", "number", "loop", "command", "people", "samples", "run");
    const auto row = [](const Instructions& s, bool in_float, LoopKind kind, Task task, int generations) {
        generation_row(s, in_float, 50, 250, kind, task, generations);
    };
    for (const Instructions& s : sets)
        for (const bool in_float : {false, true}) {
            row(s, in_float, LoopKind::continuous, Task::step, 1000);
            row(s, in_float, LoopKind::continuous, Task::step, 20);
            row(s, in_float, LoopKind::continuous, Task::staircase, 20);
            row(s, in_float, LoopKind::continuous, Task::two_records, 20);
            row(s, in_float, LoopKind::sampled, Task::step, 20);
            row(s, in_float, LoopKind::sampled, Task::staircase, 20);
        }
    for (const int population : {500, 5000})
        generation_row(sets.back(), false, population, 250, LoopKind::continuous, Task::step, 20);
    for (const std::size_t samples : {2500UL, 25000UL, 250000UL})
        if (!quick || samples < 10000) generation_row(sets.back(), false, 50, samples, LoopKind::continuous, Task::step, 20);
}

}  // namespace

int main(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
        if (std::strcmp(argv[i], "--quick") == 0) {
            quick = true;
        } else {
            std::fprintf(stderr, "usage: gaident_bench [--quick]\n");
            return 2;
        }
    }
    const FlushDenormals flush;
    std::printf("gaident_bench: best kernels here: %s; one thread\n", best_kernels().name);
    generation_rows();
    referee_row();
    simulation_rows();
    log_every_rows(quick);
    effect_rows(quick);
    return 0;
}
