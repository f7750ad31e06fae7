// The regression guard: fails when the fast path takes more than 30 % longer than it did. No absolute times: every row is timed beside a
// frozen scalar reference (frozen.cpp) in the same process, in turns below a millisecond, and
//
//     ratio = median over the turns of (time of the frozen code / time of the fast path)
//
// must be at least 1/1.3 of the ratio stored for this processor and compiler (ratios.txt). Processors differ, so on one that has no rows
// the least ratio stored for any is the guide and half of it the limit. A row that falls short is measured again, up to
// five times: a loss stays, a disturbance does not.
//
//     gaident_guard RATIOS            compare
//     gaident_guard RATIOS --store    renew the rows of this processor and compiler
#include "frozen.hpp"
#include "ratios.hpp"

#include "../../csrc/gaident/breeder.hpp"
#include "../../csrc/gaident/decode.hpp"
#include "../../csrc/gaident/denormals.hpp"
#include "../../csrc/gaident/simulate.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

using namespace gaident;

namespace {

constexpr double least_share = 1.0 / 1.3, least_share_elsewhere = 0.5;
constexpr int turns = 50, attempts = 6, store_attempts = 9;
constexpr int population = 50, generations = 4;
constexpr double Ts = 0.444e-3, kp = 0.0232 * 5.5637, ki = 1.367 * 5.5637;

double microseconds(auto&& call) {
    const auto begin = std::chrono::steady_clock::now();
    call();
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
}

double median(std::vector<double> x) {
    const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
    std::nth_element(x.begin(), middle, x.end());
    return *middle;
}

// The two-mass record of the paper, without noise: its step, or a staircase where the record is longer, so that a fast path for steps does
// not hide a loss elsewhere.
struct Data {
    std::vector<double> input, output;
    Experiment experiment;

    Data(LoopKind kind, const Kernels& kernels, std::size_t samples) : input(samples, 43.6), output(samples) {
        for (std::size_t i = 250; i < samples; ++i) input[i] = 43.6 * static_cast<double>((i / 250) % 3) - 20.0;
        const std::complex<double> poles[] = {-15.41, {-10.30, 150.9}, {-10.30, -150.9}};
        const std::complex<double> zeros[] = {{-4.26, 93.98}, {-4.26, -93.98}};
        experiment.loop.kind = kind;
        experiment.loop.kp = kp;
        experiment.loop.ki = ki;
        experiment.kernels = &kernels;
        std::vector<double> torque(samples);
        simulate<double>(factors_from_roots(6545.29, poles, zeros), input, Ts, experiment.loop, nullptr, output, torque);
        experiment.records.push_back({input, output, Ts, Start::rest, 0.0});
    }
};

// One row: the fast path with one instruction set and number type beside the frozen code on the same candidates and record.
class Row {
public:
    Row(const Kernels& kernels, bool in_float, LoopKind kind, std::size_t samples)
        : data_(kind, kernels, samples),
          genome_(ranges(), Code::binary, Scale::linear),
          settings_(settings(in_float)),
          batch_(data_.experiment, population, in_float),
          sums_(population),
          frozen_sums_(population) {
        Breeder breeder = first_generation();
        for (std::size_t i = 0; i < population; ++i) {
            candidates_.push_back(breeder.candidate(i));
            responses_.push_back(prepare(candidates_[i], data_.experiment.records[0], data_.experiment.loop, nullptr).response);
        }
        run_frozen();
        batch_.errors(candidates_, sums_);
        for (std::size_t i = 0; i < population; ++i)
            if (const double s = frozen_sums_[i]; s < 1e10 && std::abs(sums_[i] - s) > (in_float ? 1e-2 : 1e-9) * s) {
                std::fprintf(stderr, "gaident_guard: wrong answer: error sum %.17g, frozen code %.17g\n", sums_[i], s);
                std::exit(1);
            }
    }

    double simulation_ratio() {
        return ratio([&] { return microseconds([&] { batch_.errors(candidates_, sums_); }); });
    }

    // The same generations every time.
    double generation_ratio() {
        const Breeder::Group all[] = {{0, population, 0, false}};
        return ratio([&] {
            Breeder breeder = first_generation();
            return microseconds([&] {
                       for (int g = 0; g < generations; ++g) breeder.generation(all);
                   }) /
                   generations;
        });
    }

private:
    static SearchRanges ranges() {
        SearchRanges r;
        r.p_min = 1;  // p = 0 does not exist in the sampled loop
        return r;
    }
    static Settings settings(bool in_float) {
        Settings s;
        s.population = population;
        s.in_float = in_float;
        return s;
    }

    Breeder first_generation() const {
        Breeder breeder(data_.experiment, genome_, settings_, Random(3));
        breeder.randomise(0, population);
        breeder.evaluate();
        return breeder;
    }

    void run_frozen() {
        for (std::size_t i = 0; i < population; ++i)
            frozen_sums_[i] = frozen::error_sum(responses_[i].order, responses_[i].a, responses_[i].b, data_.input.data(),
                                                data_.output.data(), data_.input.size());
    }

    double ratio(auto&& fast) {
        std::vector<double> ratios;
        for (int turn = 0; turn < turns; ++turn) {
            const double slow = microseconds([&] { run_frozen(); });
            ratios.push_back(slow / fast());
        }
        return median(ratios);
    }

    Data data_;
    Genome genome_;
    Settings settings_;
    Batch batch_;
    std::vector<Factors<double>> candidates_;
    std::vector<Delta<double>> responses_;
    std::vector<double> sums_, frozen_sums_;
};

bool store = false, lost = false;

void judge(guard::Ratios& ratios, const std::string& name, auto&& measure) {
    const std::string here = guard::machine();
    if (store) {
        std::vector<double> found;
        for (int i = 0; i < store_attempts; ++i) found.push_back(measure());
        ratios.set(here, name, median(found));
        std::printf("%-28s %6.2f stored\n", name.c_str(), median(found));
        return;
    }
    const bool own = ratios.of(here, name) > 0.0;
    const double stored = own ? ratios.of(here, name) : ratios.least(name);
    const double limit = stored * (own ? least_share : least_share_elsewhere);
    double best = 0.0;
    for (int i = 0; i < attempts && (i == 0 || best < limit); ++i) best = std::max(best, measure());
    const bool bad = best < limit || stored == 0.0;
    lost = lost || bad;
    std::printf(
        "%-28s %6.2f times the frozen code; stored %6.2f, limit %6.2f%s\n", name.c_str(), best, stored, limit,
        stored == 0.0 ? "  NOT STORED" : (bad ? "  LOST" : (own && best > 1.3 * stored ? "  faster: renew the ratios" : "")));
}

void rows(guard::Ratios& ratios) {
    for (const char* set : {"baseline", "avx2", "avx512"}) {
        const Kernels* kernels = kernels_named(set);
        if (kernels == nullptr) continue;
        for (const bool in_float : {false, true}) {
            const std::string name = std::string(set) + (in_float ? " float " : " double ");
            Row record(*kernels, in_float, LoopKind::continuous, 2500);
            judge(ratios, name + "simulation", [&] { return record.simulation_ratio(); });
            Row step(*kernels, in_float, LoopKind::continuous, 250);
            judge(ratios, name + "generation", [&] { return step.generation_ratio(); });
            Row sampled(*kernels, in_float, LoopKind::sampled, 250);
            judge(ratios, name + "sampled", [&] { return sampled.generation_ratio(); });
        }
    }
}

}  // namespace

int main(int argc, char** argv) {
    store = argc == 3 && std::strcmp(argv[2], "--store") == 0;
    if (argc != 2 && !store) {
        std::fprintf(stderr, "usage: gaident_guard RATIOS [--store]\n");
        return 2;
    }
    try {
        const FlushDenormals flush;
        guard::Ratios ratios(argv[1]);
        const std::string here = guard::machine();
        if (store) ratios.forget(here);
        std::printf(
            "gaident_guard: %s%s\n", here.c_str(),
            store || ratios.knows(here) ? "" : " has no stored ratios: half the least ratio of any processor is the limit");
        rows(ratios);
        if (store) ratios.save();
    } catch (const std::exception& e) {
        std::fprintf(stderr, "gaident_guard: %s\n", e.what());
        return 2;
    }
    if (lost)
        std::fprintf(stderr,
                     "gaident_guard: the fast path has lost more than it may; where that is meant, "
                     "renew the ratios (CONTRIBUTING.md)\n");
    return lost ? 1 : 0;
}
