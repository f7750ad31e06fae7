// Prints the bits of what the recurrences give: error sums of candidates of every structure, and a run with each effect.
// Compared between processors, which must not differ: between instruction sets, with the C library's slow multiply-add in the place of
// the instruction, and on ARM64 under an emulator.
// Long enough for fast plants to decay below the smallest number, where denormals are flushed.
//
//     bits [baseline | avx2 | avx512]
#include "drive_bench.hpp"
#include "gaident/nonlinear/effect_batch.hpp"
#include "gaident/numeric/denormals.hpp"

#include <cstdio>

using namespace gaident;

namespace {

constexpr std::size_t samples = 6000;
constexpr double Ts = 0.5e-3;

void say(const std::string& what, std::span<const double> values) {
    std::printf("%s", what.c_str());
    for (const double v : values) std::printf(v == v ? " %a" : " nan", v);
    std::printf("\n");
}

// Poles of 1/s up to 2000: K, p and q of all structures in one batch.
std::vector<Factors<double>> candidates(bool sampled) {
    Random random(11);
    std::vector<Factors<double>> all;
    for (int p = sampled ? 1 : 0; p <= 3; ++p)
        for (int q = 0; q <= 3; ++q)
            for (int repeat = 0; repeat < 3; ++repeat) {
                std::vector<std::complex<double>> poles, zeros;
                const auto roots = [&](int count, auto& to) {
                    if (count % 2 != 0) to.emplace_back(-20.0 - 2000.0 * random.uniform(), 0.0);
                    for (int i = 0; i < count / 2; ++i) {
                        const double real = -5.0 - 900.0 * random.uniform(), imaginary = 20.0 + 900.0 * random.uniform();
                        const std::complex<double> root(real, imaginary);
                        to.push_back(root), to.push_back(std::conj(root));
                    }
                };
                roots(p + q, poles);
                roots(q, zeros);
                const double gain = 50.0 * (1.0 + random.uniform());
                all.push_back(factors_from_roots(gain, poles, zeros));
            }
    return all;
}

void error_sums(const Kernels& kernels) {
    std::vector<double> step(samples, 43.6), pulses(samples), output(samples, 0.0);
    for (std::size_t k = 0; k < samples; ++k) pulses[k] = k < 50 ? 30.0 : (k == 3000 ? -20.0 : 0.0);
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open})
        for (const bool constant : {true, false})
            for (const double limit : {0.0, 0.8})
                for (const bool in_float : {false, true}) {
                    const auto all = candidates(kind != LoopKind::continuous);
                    Experiment e;
                    e.kernels = &kernels;
                    e.loop.kind = kind;
                    e.loop.controller.kp = 0.05;
                    e.loop.controller.ki = 2.0;
                    if (limit > 0.0) e.loop.controller.torque_limit = limit;
                    e.records.push_back({constant ? step : pulses, output, Ts, Start::rest, 0.0});
                    std::vector<double> sums(all.size());
                    Batch(e, all.size(), in_float).errors(all, sums);
                    const std::string name = "loop " + std::to_string(static_cast<int>(kind)) + (constant ? " step" : " pulses") +
                                             (limit > 0.0 ? " limited" : "") + (in_float ? " float" : " double");
                    say(name, sums);
                }
}

// What a run with each effect ends with, its parameters of one size.
void effects(const EffectKernel& kernel) {
    std::vector<double> input(samples);
    for (std::size_t k = 0; k < samples; ++k) input[k] = k < 100 ? 30.0 : (k < 150 ? -20.0 : 0.0);
    const std::complex<double> poles[] = {-150.0, {-300.0, 400.0}, {-300.0, -400.0}},
                               zeros[] = {{-200.0, 250.0}, {-200.0, -250.0}};
    for (int e = 0; e < effect_count; ++e) {
        const EffectInfo& info = effect_table[static_cast<std::size_t>(e)];
        if (!info.simulated) continue;
        std::vector<EffectModel> models(3);
        for (std::size_t i = 0; i < models.size(); ++i) {
            models[i].linear = factors_from_roots(3000.0, poles, zeros);
            std::vector<double> values;
            for (const EffectParameter& p : info.parameters)
                values.push_back(std::clamp(0.01 * static_cast<double>(values.size() + i + 1), p.lowest, p.highest));
            models[i].add(static_cast<Effect>(e), values.data());
        }
        EffectJob job;
        job.record.input = input;
        job.record.sample_time = Ts;
        job.loop.kind = LoopKind::sampled;
        job.loop.controller.kp = 0.05;
        job.loop.controller.ki = 2.0;
        job.substeps = 2;
        job.kernel = &kernel;
        std::vector<double> velocity(models.size() * samples), some;
        try {
            simulate_effects(job, models, {}, {velocity.data(), nullptr, nullptr});
        } catch (const std::exception& refused) {
            std::printf("effect %s: %s\n", info.name, refused.what());
            continue;
        }
        for (std::size_t i = 0; i < velocity.size(); i += 499) some.push_back(velocity[i]);
        say(std::string("effect ") + info.name, some);
    }
}

}  // namespace

int main(int argc, char** argv) {
    const char* const set = argc > 1 ? argv[1] : "baseline";
    const Kernels* const kernels = kernels_named(set);
    if (kernels == nullptr) return 77;  // not on this processor
    const FlushDenormals flush;
    error_sums(*kernels);
    effects(*effects_named(set));
    return 0;
}
