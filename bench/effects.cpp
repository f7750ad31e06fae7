// The loop with effects: ns per sample for one candidate and per candidate in lanes, next to the linear loop.
// Each row first checks its answer: the lanes against the scalar loop bit for bit, the scalar loop against finer steps.
#include "../csrc/gaident/nonlinear/effect_batch.hpp"

#include "../csrc/gaident/numeric/denormals.hpp"
#include "../csrc/gaident/plant/roots.hpp"
#include "require.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

using namespace gaident;

namespace {

constexpr std::size_t samples = 3500, many = 48;

// Two masses as in Table III, each a few per cent another.
std::vector<EffectModel> drives(bool with_effects) {
    std::vector<EffectModel> all(many);
    for (std::size_t i = 0; i < many; ++i) {
        const double f = 1.0 + 0.002 * static_cast<double>(i);
        const std::complex<double> poles[] = {-16.11, {-13.53, 172.14 * f}, {-13.53, -172.14 * f}};
        const std::complex<double> zeros[] = {{-6.88, 66.38}, {-6.88, -66.38}};
        all[i].linear = factors_from_roots(9803.92 * f, poles, zeros);
        if (!with_effects) continue;
        const double lag[] = {1e-3 * f}, friction[] = {0.04 * f, 0.07 * f, 2.0}, cogging[] = {0.03, 12.0, 0.4 * f};
        all[i].add(effect<TorqueLag>, lag);
        all[i].add(effect<StribeckFriction>, friction);
        all[i].add(effect<Cogging>, cogging);
    }
    return all;
}

double rms(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return std::sqrt(sum / static_cast<double>(a.size()));
}

void row(const char* what, EffectJob job, std::span<const EffectModel> models, bool quick) {
    std::vector<double> out(models.size() * samples);
    const auto call = [&] { simulate_effects(job, models, {}, {out.data()}); };
    call();
    std::vector<double> runs;
    for (int r = 0; r < (quick ? 3 : 21); ++r) {
        const auto start = std::chrono::steady_clock::now();
        call();
        runs.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    std::sort(runs.begin(), runs.end());
    const double each = 1e9 / static_cast<double>(models.size() * samples);
    std::printf("%-9s %-34s %2zu | %8.2f [%.2f, %.2f]\n", job.kernel->name, what, models.size(), runs[runs.size() / 2] * each,
                runs.front() * each, runs.back() * each);
}

}  // namespace

void effect_rows(bool quick) {
    std::vector<double> input(samples);
    for (std::size_t k = 0; k < samples; ++k)
        input[k] = (k / 175 % 2 == 0 ? 1.0 : -1.0) * static_cast<double>((k / 350 * 7) % 30 + 1);
    EffectJob job;
    job.record.input = input;
    job.record.sample_time = 0.444e-3;
    job.record.top_speed = 30.0;
    job.loop.kind = LoopKind::sampled;
    job.loop.controller.kp = 0.08;
    job.loop.controller.ki = 1.5;
    const std::vector<EffectModel> linear = drives(false), models = drives(true);
    const std::span one(models.data(), 1);

    std::vector<double> coarse(samples), fine(samples), without(samples), lanes(many * samples), alone(many * samples);
    job.substeps = 4;
    simulate_effects(job, one, {}, {coarse.data()});
    simulate_effects(job, std::span(linear.data(), 1), {}, {without.data()});
    job.substeps = 64;
    simulate_effects(job, one, {}, {fine.data()});
    require(rms(coarse, fine) < 0.01 * rms(fine, without), "four substeps are within 1 % of the effects' own size");
    job.substeps = 4;
    job.lanes = false;
    simulate_effects(job, models, {}, {alone.data()});

    std::printf("\nEffects, two masses, %zu samples, sampled loop, 4 substeps\n", samples);
    std::printf("%-9s %-34s %2s | ns/candidate/sample: median [min, max]\n", "set", "model", "n");
    row("linear", job, std::span(linear.data(), 1), quick);
    row("lag, Stribeck friction, cogging", job, one, quick);
    job.lanes = true;
    for (const char* set : {"baseline", "avx2", "avx512"}) {
        job.kernel = effects_named(set);
        if (job.kernel == nullptr) continue;
        simulate_effects(job, models, {}, {lanes.data()});
        require(lanes == alone, "lanes with effects equal the scalar loop");
        row("linear", job, linear, quick);
        row("lag, Stribeck friction, cogging", job, models, quick);
    }
}
