// The regression guard: fails when the fast path executes 12 % more instructions than it did (counts.txt), on records so short
// that this is a loss of some 20 to 30 % in the sample loop.
// It counts and does not time, so a busy machine changes nothing; what costs time but no instructions is for gaident_bench to
// show.
// Of the loop with effects it counts a few samples with each effect alone and with all of them, eight candidates in lanes and one
// by itself.
// No random numbers, and nothing but the loop: 2 % more instructions fail.
// Compilers differ: with one that has no rows the most stored for any is the guide and twice that the limit.
//
//     gaident_guard COUNTS            compare; exit code 0: held, 1: lost, 2: wrong use, 77: nothing can be counted here
//     gaident_guard COUNTS ROW        the rows alone that have ROW in their name, such as "avx2" or "effect backlash"
//     gaident_guard COUNTS --store    renew the rows of this compiler, on a processor with all instruction sets
#include "counts.hpp"
#include "instructions.hpp"

#include "../../csrc/gaident/identification/velocity_objective.hpp"
#include "../../csrc/gaident/search/breeder.hpp"
#include "../../csrc/gaident/genetic/decode.hpp"
#include "../../csrc/gaident/nonlinear/effect_batch.hpp"
#include "../../csrc/gaident/numeric/denormals.hpp"
#include "../../csrc/gaident/simulation/simulate.hpp"

#include <cstdio>
#include <cstring>

using namespace gaident;

namespace {

constexpr double most_share = 1.15, most_share_effects = 1.02, most_share_elsewhere = 2.0;
constexpr int population = 8, cannot_count = 77;  // all lanes of the widest set in double
constexpr double Ts = 0.444e-3, kp = 0.0232 * 5.5637, ki = 1.367 * 5.5637;

// The first samples of the paper's two-mass record, without noise: its step, or a staircase, so that a fast path for steps does
// not hide a loss elsewhere.
// Short: a trap costs microseconds.
constexpr std::size_t samples = 100;
enum class Command { step, staircase };

struct Data {
    std::vector<double> input, output;
    Experiment experiment;

    Data(LoopKind kind, const Kernels& kernels, Command command) : input(samples, 43.6), output(samples) {
        if (command == Command::staircase)
            for (std::size_t i = 0; i < samples; ++i) input[i] = 43.6 * static_cast<double>((i / 25) % 3) - 20.0;
        const std::complex<double> poles[] = {-15.41, {-10.30, 150.9}, {-10.30, -150.9}};
        const std::complex<double> zeros[] = {{-4.26, 93.98}, {-4.26, -93.98}};
        experiment.loop.kind = kind;
        experiment.loop.controller.kp = kp;
        experiment.loop.controller.ki = ki;
        experiment.kernels = &kernels;
        std::vector<double> torque(samples);
        simulate<double>(factors_from_roots(6545.29, poles, zeros), input, Ts, experiment.loop, nullptr, output, torque);
        experiment.records.push_back({input, output, Ts, Start::rest, 0.0});
    }
};

// One instruction set and number type on one record.
class Row {
public:
    Row(const Kernels& kernels, bool in_float, LoopKind kind, Command command)
        : data_(kind, kernels, command),
          settings_(settings(in_float)),
          objective_(data_.experiment, ranges(), settings_),
          breeder_(objective_, settings_, Random(3), kernels.words) {
        breeder_.randomise(0, population);
        // Behind a hold the structures are converted apart, eight lanes each: one structure, so that there is one conversion to
        // count.
        fixed_ = kind == LoopKind::sampled;
        for (std::size_t i = 0; fixed_ && i < population; ++i) objective_.genome().set_structure(breeder_[i], 1, 2);
        breeder_.evaluate();
    }

    double generation() {
        const Breeder::Group all[] = {{0, population, 0, fixed_}};
        return per_sample(guard::instructions([&] { breeder_.generation(all); }));
    }

    double simulation() {
        Batch batch(data_.experiment, population, settings_.in_float);
        std::vector<Factors<double>> candidates;
        for (std::size_t i = 0; i < population; ++i) candidates.push_back(objective_.factors(breeder_[i]));
        std::vector<double> sums(population);
        return per_sample(guard::instructions([&] { batch.errors(candidates, sums); }));
    }

private:
    static SearchRanges ranges() {
        SearchRanges r;
        r.p_min = 1;  // p = 0 does not exist in the sampled loop
        return r;
    }
    static PlantSettings settings(bool in_float) {
        PlantSettings s;
        s.population = population;
        s.in_float = in_float;
        return s;
    }
    double per_sample(std::uint64_t count) const {
        return static_cast<double>(count) / (population * static_cast<double>(samples));
    }

    Data data_;
    PlantSettings settings_;
    VelocityObjective objective_;
    Breeder breeder_;
    bool fixed_ = false;
};

// Typical sizes of each effect.
struct Sizes {
    const char* name;
    double values[5];
};
constexpr Sizes sizes[] = {
    {"coulomb_friction", {0.05}},
    {"stribeck_friction", {0.04, 0.07, 2.0}},
    {"asymmetric_friction", {0.05, 0.035, 1e-4, 4e-4}},
    {"presliding_friction", {0.05, 3.0}},
    {"lugre_friction", {0.04, 0.07, 2.0, 10.0, 0.005}},
    {"quadratic_drag", {1.5e-5}},
    {"square_root_drag", {5e-3}},
    {"load_torque", {0.03}},
    {"unbalance", {0.05, 0.3}},
    {"cogging", {0.03, 12.0, 0.4}},
    {"friction_drift", {0.05, -0.2}},
    {"load_dependent_friction", {0.04, 0.2}},
    {"position_friction", {0.05, 0.6, 3.0, 0.4}},
    {"torque_hum", {0.04, 50.0, 0.3}},
    {"position_inertia", {0.3, 1.0, 0.4}},
    {"backlash", {0.01}},
    {"hardening_stiffness", {1e4}},
    {"hysteretic_coupling", {0.1, 1.0}},
    {"torque_saturation", {0.5}},
    {"torque_dead_band", {0.03}},
    {"transport_delay", {0.3e-3}},
    {"torque_lag", {1e-3}},
    {"integrator_clamp", {0.05}},
    {"command_rate_limit", {3000.0}},
    {"velocity_difference", {3.0}},
    {"velocity_observer", {3000.0}},
    {"velocity_filter", {1e-3}},
    {"velocity_ripple", {0.005, 2.0, 0.2}},
    {"velocity_quantisation", {0.6}},
};

bool in_lanes_only(const char* name) { return effects_in_lanes_only().has(effect_named(name)); }

// The loop with effects, two masses, two substeps, from rest, without what a run costs that has no samples.
// `chosen`: all but those of the coupling and the mechanism, which run in other loops, or one by name.
double effect_instructions(const EffectKernel& kernel, bool alone, const std::string& chosen) {
    const std::complex<double> poles[] = {-15.41, {-10.30, 150.9}, {-10.30, -150.9}};
    const std::complex<double> zeros[] = {{-4.26, 93.98}, {-4.26, -93.98}};
    std::vector<EffectModel> models(alone ? 1 : effect_lanes);
    for (EffectModel& m : models) {
        m.linear = factors_from_roots(6545.29, poles, zeros);
        for (int e = 0; e < effect_count; ++e) {
            const EffectInfo& info = effect_table[static_cast<std::size_t>(e)];
            const bool in_all = !info.needs_two_masses && info.place != Place::mechanism && !(alone && in_lanes_only(info.name));
            for (const Sizes& s : sizes)
                if (s.name == std::string(info.name) && (chosen == "all" ? in_all : chosen == s.name))
                    m.add(static_cast<Effect>(e), s.values);
        }
    }
    const std::size_t width = models.size();
    constexpr std::size_t samples_with_effects = 6;  // the command changes its sign in between
    std::vector<double> input(samples_with_effects), velocity(samples_with_effects * width), constants(effect_constants * width),
        history(4 * width);
    for (std::size_t k = 0; k < samples_with_effects; ++k) input[k] = k < 3 ? 30.0 : -20.0;
    EffectRecord record;
    record.input = input;
    record.sample_time = Ts;
    EffectRun run;
    run.loop.kind = LoopKind::sampled;
    run.loop.controller.kp = kp;
    run.loop.controller.ki = ki;
    run.effects = models[0].effects;
    run.sample_time = Ts;
    run.substeps = 2;
    run.order = 3;
    run.velocity = velocity.data();
    class GoesOn final : public EffectSink {
        bool take(std::size_t) override { return true; }
    } goes_on;
    run.sink = &goes_on;
    std::vector<Effects::Tables> tables(width);
    for (std::size_t lane = 0; lane < width; ++lane) {
        PreparedEffects c;
        prepare_effects(models[lane], record, run.loop, run.substeps, nullptr, c);
        double flat[effect_constants];
        std::memcpy(flat, &c.constants, sizeof flat);
        for (std::size_t k = 0; k < effect_constants; ++k) constants[k * width + lane] = flat[k];
        tables[lane] = c.tables;
        run.two_masses = c.two_masses;
    }
    run.tables = tables.data();
    run.history = history.data();
    run.history_mask = 3;
    const auto go = [&](std::size_t n) {
        run.input = std::span(input).first(n);
        (alone ? kernel.alone : kernel.run)(run, constants.data());
    };
    go(samples_with_effects);  // the first call also looks up what the library brings along
    const auto count = [&](std::size_t n) { return static_cast<double>(guard::instructions([&] { go(n); })); };
    return (count(samples_with_effects) - count(0)) / static_cast<double>(samples_with_effects * width);
}

// Compares or stores row after row, each counted only where it is asked for.
class Judge {
public:
    Judge(const char* path, bool store, std::string part) : counts_(path), store_(store), part_(std::move(part)) {
        if (store_) counts_.forget(here_);
        std::printf("gaident_guard: %s%s\n", here_.c_str(),
                    store_ || counts_.knows(here_) ? "" : " has no stored counts: twice the most of any compiler is the limit");
    }

    // `count` gives the instructions; `share`: how many times those stored they may be.
    void row(const std::string& name, double share, auto&& count) {
        if (name.find(part_) == std::string::npos) return;
        ++judged_;
        const double now = count();
        if (store_) {
            counts_.set(here_, name, now);
            std::printf("%-36s %8.3f stored\n", name.c_str(), now);
            return;
        }
        const bool own = counts_.of(here_, name) > 0.0;
        const double stored = own ? counts_.of(here_, name) : counts_.most(name);
        const double limit = stored * (own ? share : most_share_elsewhere);
        const bool bad = now > limit || stored == 0.0;
        lost_ = lost_ || bad;
        std::printf(
            "%-36s %8.3f instructions per candidate and sample; stored %8.3f, limit %8.3f%s\n", name.c_str(), now, stored, limit,
            stored == 0.0 ? "  NOT STORED" : (bad ? "  LOST" : (own && share * now < stored ? "  fewer: renew the counts" : "")));
    }

    // Whether a row was lost. Throws std::runtime_error where no row was judged.
    bool finish() const {
        if (judged_ == 0) throw std::runtime_error("no row on this processor has \"" + part_ + "\" in its name");
        if (store_) counts_.save();
        return lost_;
    }
    bool storing() const { return store_; }

private:
    const std::string here_ = guard::compiler();
    guard::Counts counts_;
    bool store_, lost_ = false;
    std::string part_;
    int judged_ = 0;
};

void rows(Judge& judge) {
    for (const char* set : {"baseline", "avx2", "avx512"}) {
        const Kernels* kernels = kernels_named(set);
        if (kernels == nullptr && judge.storing())
            throw std::runtime_error(std::string("to store, a processor with ") + set + " is needed");
        if (kernels == nullptr) continue;
        for (const bool in_float : {false, true}) {
            const std::string name = std::string(set) + (in_float ? " float " : " double ");
            const auto row = [&](LoopKind kind, Command command) { return Row(*kernels, in_float, kind, command); };
            judge.row(name + "simulation", most_share,
                      [&] { return row(LoopKind::continuous, Command::staircase).simulation(); });
            judge.row(name + "generation", most_share, [&] { return row(LoopKind::continuous, Command::step).generation(); });
            // Its conversion is in double for both.
            if (!in_float)
                judge.row(name + "sampled", most_share, [&] { return row(LoopKind::sampled, Command::step).generation(); });
        }
    }
}

void effect_rows(Judge& judge) {
    for (const char* set : {"alone", "baseline", "avx2", "avx512"}) {
        const bool alone = set == std::string("alone");  // one candidate, as AVX2 has it
        const EffectKernel* kernel = effects_named(alone ? "avx2" : set);
        if (kernel == nullptr) continue;
        const auto row = [&](const std::string& chosen) {
            judge.row(std::string(set) + " effect " + chosen, most_share_effects,
                      [&] { return effect_instructions(*kernel, alone, chosen); });
        };
        for (const Sizes& s : sizes)
            if (!alone || !in_lanes_only(s.name)) row(s.name);
        row("all");
    }
}

}  // namespace

int main(int argc, char** argv) {
    const bool store = argc == 3 && std::strcmp(argv[2], "--store") == 0;
    if (argc < 2 || argc > 3) {
        std::fprintf(stderr, "usage: gaident_guard COUNTS [--store | a part of the names of the rows to compare]\n");
        return 2;
    }
    volatile double x = 1.0;
    if (guard::instructions([&] { x = x * 3.0; }) == 0) {
        std::fprintf(stderr, "gaident_guard: this system sends no trap per instruction, so nothing is counted\n");
        return cannot_count;
    }
    bool lost = false;
    try {
        const FlushDenormals flush;
        Judge judge(argv[1], store, argc == 3 && !store ? argv[2] : "");
        rows(judge);
        effect_rows(judge);
        lost = judge.finish();
    } catch (const std::exception& e) {
        std::fprintf(stderr, "gaident_guard: %s\n", e.what());
        return 2;
    }
    if (lost)
        std::fprintf(stderr,
                     "gaident_guard: the fast path executes more instructions than it may; where that is meant, "
                     "renew the counts (CONTRIBUTING.md)\n");
    return lost ? 1 : 0;
}
