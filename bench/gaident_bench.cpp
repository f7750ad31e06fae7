// Times the core without Python: ns per candidate and sample, us per candidate, us per generation; per arithmetic, instruction set,
// population, record length and loop. Every row first checks its answer against the referee. `--quick` runs fewer repetitions.
#include "../csrc/gaident/decode.hpp"
#include "../csrc/gaident/denormals.hpp"
#include "../csrc/gaident/breeder.hpp"
#include "../csrc/gaident/reference/cascade.hpp"
#include "../csrc/gaident/simulate.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

using namespace gaident;

namespace {

constexpr double Ts = 0.444e-3, kp = 0.0232 * 5.5637, ki = 1.367 * 5.5637;
bool quick = false;

struct Figures {
    double median, lowest, highest;
};

// Seconds per call: median, minimum and maximum over repetitions of about 20 ms each.
template <class F>
Figures time_of(F&& call) {
    using Clock = std::chrono::steady_clock;
    const auto seconds = [](auto d) { return std::chrono::duration<double>(d).count(); };
    call();
    const auto begin = Clock::now();
    call();
    const double one = std::max(seconds(Clock::now() - begin), 1e-7);
    const auto count = std::max<std::size_t>(1, static_cast<std::size_t>((quick ? 2e-3 : 2e-2) / one));
    std::vector<double> runs;
    for (int r = 0; r < (quick ? 3 : 11); ++r) {
        const auto start = Clock::now();
        for (std::size_t i = 0; i < count; ++i) call();
        runs.push_back(seconds(Clock::now() - start) / static_cast<double>(count));
    }
    std::sort(runs.begin(), runs.end());
    return {runs[runs.size() / 2], runs.front(), runs.back()};
}

void require(bool right, const char* what) {
    if (right) return;
    std::fprintf(stderr, "gaident_bench: wrong answer: %s\n", what);
    std::exit(1);
}

SearchRanges paper_ranges() { return {}; }

// A two-mass record as in the paper, or a staircase for longer ones.
struct Data {
    std::vector<double> input, output;
    Experiment experiment;

    Data(std::size_t samples, LoopKind kind) : input(samples), output(samples) {
        for (std::size_t i = 0; i < samples; ++i) input[i] = samples <= 250 ? 43.6 : 43.6 * static_cast<double>((i / 250) % 3) - 20.0;
        const std::complex<double> poles[] = {-15.41, {-10.30, 150.9}, {-10.30, -150.9}};
        const std::complex<double> zeros[] = {{-4.26, 93.98}, {-4.26, -93.98}};
        experiment.loop.kind = kind;
        experiment.loop.kp = kp;
        experiment.loop.ki = ki;
        std::vector<double> torque(samples);
        simulate<double>(factors_from_roots(6545.29, poles, zeros), input, Ts, experiment.loop, nullptr, output, torque);
        Random random(1);
        for (double& y : output) y += 0.6 * (random.uniform() + random.uniform() + random.uniform() - 1.5);
        experiment.records.push_back({input, output, Ts, Start::rest, 0.0});
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
void check_batch(const Data& data, std::span<const Factors<double>> all, std::span<const double> sums, double tolerance, const char* what) {
    if (data.input.size() > 25000) return;  // the referee takes its time; shorter rows have checked the same code
    for (std::size_t i = 0; i < all.size(); i += all.size() / 7 + 1) {
        const std::vector<double> y = reference::run(chain_of(all[i]), data.input, Ts, data.experiment.loop).velocity;
        double sum = 0.0, size = 0.0;
        for (std::size_t k = 0; k < y.size(); ++k) {
            sum += (data.output[k] - y[k]) * (data.output[k] - y[k]);
            size += data.output[k] * data.output[k] + y[k] * y[k];
        }
        if (sum < 1e10) require(std::abs(sums[i] - sum) <= tolerance * size, what);  // not where it diverges
    }
}

void simulation_rows() {
    std::printf("\nSimulation of a batch (decode excluded, coefficients included), 48 candidates of one structure\n");
    std::printf("%-9s %-7s %-11s %5s %8s | ns/candidate/sample: median [min, max] | us/candidate\n", "set", "number", "loop", "order", "samples");
    for (const char* set : {"baseline", "avx2", "avx512"}) {
        const Kernels* kernels = kernels_named(set);
        if (kernels == nullptr) continue;
        for (const bool in_float : {false, true})
            for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled})
                for (const auto& [p, q] : {std::pair{1, 0}, {1, 2}, {3, 3}}) {
                    Data data(250, kind);
                    data.experiment.kernels = kernels;
                    const auto all = candidates(48, p, q);
                    std::vector<double> sums(all.size());
                    Batch batch(data.experiment, all.size(), in_float);
                    batch.errors(all, sums);
                    check_batch(data, all, sums, in_float ? 1e-4 : 1e-9, "batch");
                    const Figures t = time_of([&] { batch.errors(all, sums); });
                    const double each = 1e9 / (48.0 * 250.0);
                    std::printf("%-9s %-7s %-11s %5d %8d | %8.3f [%.3f, %.3f] | %8.3f\n", set, in_float ? "float" : "double",
                                kind == LoopKind::continuous ? "continuous" : "sampled", 1 + p + q, 250, t.median * each, t.lowest * each,
                                t.highest * each, t.median * 1e6 / 48.0);
                }
    }
}

void referee_row() {
    Data data(250, LoopKind::continuous);
    const auto all = candidates(8, 3, 3);
    std::vector<double> y(250), u(250), r(250);
    const Figures t = time_of([&] { simulate<double>(all[0], data.input, Ts, data.experiment.loop, nullptr, y, u); });
    std::printf("\nOne candidate, scalar, order 7, with torque: %.3f ns per sample [%.3f, %.3f]\n", t.median * 4e6, t.lowest * 4e6, t.highest * 4e6);
}

void generation_row(const Kernels& kernels, bool in_float, int population, std::size_t samples, LoopKind kind) {
    Data data(samples, kind);
    data.experiment.kernels = &kernels;
    SearchRanges ranges = paper_ranges();
    if (kind != LoopKind::continuous) ranges.p_min = 1;
    const Genome genome(ranges, Code::binary, Scale::linear);
    Settings settings;
    settings.population = population;
    settings.in_float = in_float;
    Breeder breeder(data.experiment, genome, settings, Random(3));
    const auto n = static_cast<std::size_t>(population);
    const Breeder::Group all[] = {{0, static_cast<std::uint32_t>(population), 0, false}};
    breeder.randomise(0, n);
    breeder.evaluate();
    std::vector<Factors<double>> now;
    std::vector<double> sums(n);
    for (std::size_t i = 0; i < n; ++i) {
        now.push_back(breeder.candidate(i));
        sums[i] = breeder.cost(i) - 2.0 * (now[i].structure.p + now[i].structure.q);
    }
    check_batch(data, now, sums, in_float ? 1e-4 : 1e-9, "generation");
    const Figures t = time_of([&] { breeder.generation(all); });
    std::printf("%-9s %-7s %-11s %10d %8zu | %10.2f [%.2f, %.2f] | %8.1f\n", kernels.name, in_float ? "float" : "double",
                kind == LoopKind::continuous ? "continuous" : "sampled", population, samples, t.median * 1e6, t.lowest * 1e6,
                t.highest * 1e6, t.median * 1e12 / (static_cast<double>(population) * static_cast<double>(samples)));
}

void generation_rows() {
    std::printf("\nA whole generation (decode, simulate, select, cross, mutate), 194 bits, orders 1 to 7 mixed\n");
    std::printf("%-9s %-7s %-11s %10s %8s | us/generation: median [min, max] | ps/candidate/sample\n", "set", "number", "loop", "population", "samples");
    for (const char* set : {"baseline", "avx2", "avx512"}) {
        const Kernels* kernels = kernels_named(set);
        if (kernels == nullptr) continue;
        for (const bool in_float : {false, true}) {
            generation_row(*kernels, in_float, 50, 250, LoopKind::continuous);
            generation_row(*kernels, in_float, 50, 250, LoopKind::sampled);
        }
    }
    for (const int population : {500, 5000}) generation_row(best_kernels(), false, population, 250, LoopKind::continuous);
    for (const std::size_t samples : {2500UL, 25000UL, 250000UL})
        if (!quick || samples < 10000) generation_row(best_kernels(), false, 50, samples, LoopKind::continuous);
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
    referee_row();
    simulation_rows();
    generation_rows();
    return 0;
}
