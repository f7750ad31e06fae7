#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/genetic/decode.hpp"
#include "gaident/identification/plant_search.hpp"
#include "gaident/estimation/parameters.hpp"
#include "gaident/search/breeder.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

using namespace gaident;

namespace {

PlantSettings paper(int generations) {
    PlantSettings s;
    s.generations = generations;
    return s;
}

PlantSettings species(int generations) {
    PlantSettings s;
    s.species = true;
    s.code = Code::gray;
    s.generations = generations;
    s.round = generations;
    return s;
}

SearchRanges few() {
    SearchRanges r;
    r.p_min = 1;
    r.p_max = 1;
    r.q_max = 2;
    return r;
}

bool same(const Refined& a, const Refined& b) {
    return pack(a.factors, a.starts) == pack(b.factors, b.starts) && a.cost == b.cost && a.iterations == b.iterations &&
           a.converged == b.converged && a.at_bound == b.at_bound && a.factors.structure == b.factors.structure;
}

bool same(const PlantTrial& a, const PlantTrial& b) {
    bool equal = a.history == b.history && a.best_fitness == b.best_fitness && a.best_generation == b.best_generation &&
                 a.best == b.best && a.evaluations == b.evaluations && a.species.size() == b.species.size();
    for (std::size_t i = 0; equal && i < a.species.size(); ++i) equal = same(a.species[i], b.species[i]);
    return equal;
}

std::vector<const Kernels*> available() {
    std::vector<const Kernels*> all;
    for (const char* name : {"baseline", "avx2", "avx512"})
        if (const Kernels* k = kernels_named(name)) all.push_back(k);
    return all;
}

}  // namespace

TEST_CASE("engine: the best fitness of a plain run never rises with an elite, and its log is right") {
    const Bench bench(two_mass());
    for (const int elites : {0, 1, 3}) {
        PlantSettings s = paper(80);
        s.elites = elites;
        Progress progress;
        const auto trials = search_plant(bench.experiment, SearchRanges{}, s, 2, 3, 1, progress);
        for (const PlantTrial& t : trials) {
            CHECK(t.history.size() == 80);
            CHECK(t.evaluations == 50 * 80);
            CHECK(t.species.empty());
            double least = worst_fitness;
            for (std::size_t i = 0; i < t.history.size(); ++i) {
                CHECK(!std::isnan(t.history[i]));
                if (elites > 0 && i > 0) CHECK(t.history[i] <= t.history[i - 1]);
                least = std::min(least, t.history[i]);
            }
            CHECK(t.best_fitness == least);
            CHECK(t.history[static_cast<std::size_t>(t.best_generation)] == least);
            const Genome genome(SearchRanges{}, s.code, s.roots);
            const Factors<double> g = decode(t.best.data(), genome);
            double sum;
            Batch(bench.experiment, 1, false).errors({&g, 1}, {&sum, 1});
            CHECK(fitness(sum, g.structure, s.weights) == t.best_fitness);
        }
        CHECK(progress.done == 160);
        CHECK(progress.best == std::min(trials[0].best_fitness, trials[1].best_fitness));
        CHECK(!same(trials[0], trials[1]));
    }
}

TEST_CASE("engine: same seed, same result, for any number of workers; another seed, another result") {
    const Bench bench(two_mass());
    for (const bool with_species : {false, true}) {
        const PlantSettings s = with_species ? species(15) : paper(40);
        const int trials = with_species ? 2 : 5;
        std::vector<PlantTrial> first;
        for (const int workers : {1, 2, 3, 7}) {
            Progress progress;
            const auto result = search_plant(bench.experiment, few(), s, trials, 11, workers, progress);
            if (first.empty()) first = result;
            for (std::size_t i = 0; i < result.size(); ++i) CHECK(same(result[i], first[i]));
        }
        // A trial does not depend on how many others there are.
        Progress progress;
        CHECK(same(search_plant(bench.experiment, few(), s, 1, 11, 4, progress)[0], first[0]));
        CHECK(search_plant(bench.experiment, few(), s, 1, 12, 1, progress)[0].history != first[0].history);
    }
}

TEST_CASE("engine: a long record is searched by several threads to the same result") {
    Bench bench(two_mass(LoopKind::sampled, 5000));
    Random random(5);
    for (std::size_t i = 0; i < bench.measured.input.size(); i += 250)
        std::fill_n(bench.measured.input.begin() + static_cast<std::ptrdiff_t>(i), 250, 40.0 * reference::normal(random));
    bench.drive.input = bench.measured.input;
    bench.measured = reference::Measurement(bench.drive, 0.3, 18);
    bench.experiment.records[0] = bench.measured.record();
    std::vector<PlantTrial> results;
    for (const int workers : {1, 2, 3, 5}) {
        Progress progress;
        results.push_back(search_plant(bench.experiment, few(), species(6), 1, 13, workers, progress)[0]);
        CHECK(same(results.back(), results.front()));
        CHECK(progress.done == results.back().history.size());
        CHECK(progress.best == results.back().best_fitness);
        const auto& fits = results.back().species;
        const auto least =
            std::min_element(fits.begin(), fits.end(), [](const Refined& x, const Refined& y) { return x.cost < y.cost; });
        CHECK(progress.species == fits.size());
        CHECK(leading_structure(few(), progress) == least->factors.structure);
    }
    // The best chromosome of all islands is the one that is reported.
    const Genome genome(few(), Code::gray, Scale::linear);
    const Factors<double> g = decode(results[0].best.data(), genome);
    double sum;
    Batch(bench.experiment, 1, false).errors({&g, 1}, {&sum, 1});
    CHECK_NEAR(fitness(sum, g.structure, FitnessWeights{}), results[0].best_fitness, 1e-12 * results[0].best_fitness);
}

TEST_CASE("engine: the plain engine shares the candidates of a long record, to the same result") {
    const Bench bench(two_mass(LoopKind::continuous, 12000));
    std::vector<std::vector<PlantTrial>> results;
    for (const int workers : {1, 2, 3}) {
        Progress progress;
        results.push_back(search_plant(bench.experiment, SearchRanges{}, paper(4), 2, 13, workers, progress));
        for (std::size_t i = 0; i < 2; ++i) CHECK(same(results.back()[i], results.front()[i]));
    }
}

TEST_CASE("engine: every kernel set gives the identical trial, in double and in float") {
    Bench bench(two_mass());
    for (const bool limited : {false, true})
        for (const bool in_float : {false, true})
            for (const bool with_species : {false, true}) {
                if (with_species && limited) continue;
                bench.experiment.loop.controller.torque_limit = limited ? 3.0 : std::numeric_limits<double>::infinity();
                PlantSettings s = with_species ? species(10) : paper(30);
                s.in_float = in_float;
                std::vector<PlantTrial> first;
                for (const Kernels* k : available()) {
                    bench.experiment.kernels = k;
                    Progress progress;
                    const auto result =
                        search_plant(bench.experiment, with_species ? few() : SearchRanges{}, s, 1, 21, 1, progress);
                    if (first.empty()) first = result;
                    CHECK(same(result[0], first[0]));
                }
            }
}

TEST_CASE("engine: a candidate that diverges gets the worst fitness, never NaN, and does not spoil a run") {
    const Bench bench(two_mass(LoopKind::continuous, 3000));
    SearchRanges wild;
    wild.real = {-3000.0, 3000.0};
    wild.imaginary = {0.0, 3000.0};
    for (const bool in_float : {false, true}) {
        PlantSettings s;
        s.in_float = in_float;
        s.elites = 1;
        s.code = Code::gray;
        const VelocityObjective objective(bench.experiment, wild, s);
        Breeder breeder(objective, s, Random(6));
        breeder.randomise(0, 50);
        breeder.evaluate();
        const Breeder::Group all[] = {{0, 50, 1, false}};
        int diverged = 0;
        for (int g = 0; g < 20; ++g) {
            for (std::size_t i = 0; i < 50; ++i) {
                CHECK(breeder.cost(i) >= 0.0 && breeder.cost(i) <= worst_fitness);  // false for NaN
                diverged += breeder.cost(i) == worst_fitness ? 1 : 0;
            }
            breeder.generation(all);
        }
        CHECK(diverged > 20);
        Progress progress;
        s.code = Code::binary;
        s.generations = 60;
        const PlantTrial t = search_plant(bench.experiment, wild, s, 1, 1, 1, progress)[0];
        CHECK(t.best_fitness < worst_fitness);
        for (std::size_t i = 1; i < t.history.size(); ++i) CHECK(t.history[i] <= t.history[i - 1]);
    }
}

TEST_CASE("engine: the stop flag ends a long run quickly") {
    using Clock = std::chrono::steady_clock;
    struct Long {
        PlantSettings settings;
        std::size_t samples;
        int workers;
    };
    PlantSettings large = paper(1000000);
    large.population = 2000;
    PlantSettings refining = species(1000000);
    refining.round = 20;
    refining.quiet_rounds = 1000000;
    for (const Long& run :
         {Long{paper(1000000), 250, 1}, Long{paper(1000000), 250, 2}, Long{large, 50000, 1}, Long{refining, 20000, 2}}) {
        Bench bench(two_mass(LoopKind::continuous, run.samples));
        double seconds = 1e9;  // of the fastest: a disturbance goes, a delay stays
        for (int attempt = 0; attempt < 5 && seconds >= 0.2; ++attempt) {
            std::atomic<bool> stop{false};
            bench.experiment.stop = &stop;
            Clock::time_point asked;
            std::thread user([&] {
                std::this_thread::sleep_for(std::chrono::milliseconds(60));
                asked = Clock::now();
                stop = true;
            });
            Progress progress;
            bool stopped = false;
            try {
                search_plant(bench.experiment, SearchRanges{}, run.settings, 3, 1, run.workers, progress);
            } catch (const Stopped&) {
                stopped = true;
            }
            const Clock::time_point ended = Clock::now();
            user.join();
            CHECK(stopped);
            seconds = std::min(seconds, std::chrono::duration<double>(ended - asked).count());
        }
        std::printf("stopped within %.1f ms\n", 1e3 * seconds);
        CHECK(seconds < 0.2);
    }
}
