// What the tests of the loop with effects have in common: drives, a command, sizes of every effect, and lanes against scalar.
#pragma once

#include "../../../csrc/gaident/nonlinear/effect_batch.hpp"
#include "../../../csrc/gaident/plant/roots.hpp"

#include "check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

namespace gaident::cases {

inline constexpr double Ts = 1e-3;

inline Factors<double> one_mass(double J = 5e-4, double D = 0.005) {
    const std::complex<double> pole = -D / J;
    return factors_from_roots(1.0 / J, {&pole, 1}, {});
}

// Two masses; f: of the resonance.
inline Factors<double> table_three(double f = 1.0) {
    const std::complex<double> poles[] = {-16.11, {-13.53, 172.14 * f}, {-13.53, -172.14 * f}};
    const std::complex<double> zeros[] = {{-6.88, 66.38}, {-6.88, -66.38}};
    return factors_from_roots(9803.92, poles, zeros);
}

using Values = std::array<double, 12>;

// Typical parameters, and ones so small (or large) that the effect does next to nothing without being taken out.
struct Sizes {
    Effect effect;
    Values typical, slight;

    const EffectInfo& info() const { return info_of(effect); }
};

inline const Sizes sizes[] = {
    {effect<CoulombFriction>, {0.05}, {1e-14}},
    {effect<StribeckFriction>, {0.04, 0.07, 2.0}, {1e-14, 2e-14, 2.0}},
    {effect<AsymmetricFriction>, {0.05, 0.035, 1e-4, 4e-4}, {1e-14, 1e-14, 1e-16, 1e-16}},
    {effect<PreslidingFriction>, {0.05, 3.0}, {1e-14, 3.0}},
    {effect<LugreFriction>, {0.04, 0.07, 2.0, 10.0, 0.005}, {1e-14, 2e-14, 2.0, 10.0, 1e-16}},
    {effect<QuadraticDrag>, {1.5e-5}, {1e-18}},
    {effect<SquareRootDrag>, {5e-3}, {1e-14}},
    {effect<LoadTorque>, {0.03}, {1e-14}},
    {effect<Unbalance>, {0.05, 0.3}, {1e-14, 0.3}},
    {effect<Cogging>, {0.03, 12.0, 0.4}, {1e-14, 12.0, 0.4}},
    {effect<CoggingWaves>, {0.03, 12.0, 0.4, 0.02, 4.0, 1.0}, {1e-14, 12.0, 0.4, 1e-14, 4.0, 1.0}},
    {effect<FrictionDrift>, {0.05, -0.2}, {1e-14, -0.2}},
    {effect<LoadDependentFriction>, {0.04, 0.2}, {1e-14, 1e-14}},
    {effect<PositionFriction>, {0.05, 0.6, 3.0, 0.4}, {1e-14, 0.6, 3.0, 0.4}},
    {effect<TorqueHum>, {0.04, 50.0, 0.3}, {1e-14, 50.0, 0.3}},
    {effect<PositionInertia>, {0.3, 1.0, 0.4}, {1e-14, 1.0, 0.4}},
    {effect<Backlash>, {0.01}, {1e-15}},
    {effect<HardeningStiffness>, {1e3}, {1e-10}},
    {effect<HystereticCoupling>, {0.1, 1.0}, {1e-12, 1e-9}},
    {effect<TorqueSaturation>, {0.5}, {1e14}},
    {effect<TorqueDeadBand>, {0.03}, {1e-14}},
    {effect<TransportDelay>, {0.73e-3}, {1e-16}},
    {effect<TorqueLag>, {1e-3}, {1e-16}},
    {effect<IntegratorClamp>, {0.05}, {1e14}},
    {effect<CommandRateLimit>, {3000.0}, {1e14}},
    {effect<VelocityDifference>, {3.0}, {0.0}},  // it has no slight one
    {effect<VelocityObserver>, {3000.0}, {1e16}},
    {effect<VelocityFilter>, {1e-3}, {1e-16}},
    {effect<VelocityRipple>, {0.005, 2.0, 0.2}, {1e-14, 2.0, 0.2}},
    {effect<VelocityRippleWaves>, {0.005, 2.0, 0.2, 0.003, 1.0, 1.0}, {1e-14, 2.0, 0.2, 1e-14, 1.0, 1.0}},
    {effect<VelocityQuantisation>, {0.6}, {1e-13}},
    {effect<ExtraResonance>, {900.0, 0.02, 800.0, 0.02}, {900.0, 0.02, 900.0 + 1e-10, 0.02}},
};

// The same of every shaft effect at the load.
inline std::vector<Sizes> sizes_at_load() {
    std::vector<Sizes> found;
    for (Sizes s : sizes) {
        if (s.info().place != Place::shaft) continue;
        s.effect = effect_named(std::string(s.info().name) + "@load");
        found.push_back(s);
    }
    return found;
}

inline Values scaled(Values values, double factor) {
    for (double& value : values) value *= factor;
    return values;
}

// The neutral parameters; those with which any value is neutral, as they are.
inline Values neutral_of(const Sizes& s, const Values& otherwise) {
    Values values = otherwise;
    for (int i = 0; i < s.info().count(); ++i) {
        const double value = s.info().parameters[static_cast<std::size_t>(i)].neutral;
        if (value == value) values[static_cast<std::size_t>(i)] = value;
    }
    return values;
}

inline std::vector<double> staircase(std::size_t n, double scale = 1.0) {
    const double level[] = {3.0, -5.0, 20.0, 1.0, -40.0, 10.0, 0.0, -2.0, 60.0, -60.0};
    std::vector<double> r(n);
    for (std::size_t k = 0; k < n; ++k) r[k] = scale * level[k * 10 / n];
    return r;
}

// A command as this loop takes it: in the open one a torque.
inline std::vector<double> input_of(std::size_t n, LoopKind kind) { return staircase(n, kind == LoopKind::open ? 0.01 : 1.0); }

inline EffectJob job_of(std::span<const double> input, LoopKind kind) {
    EffectJob job;
    job.record.input = input;
    job.record.sample_time = Ts;
    job.record.top_speed = 60.0;
    job.loop.kind = kind;
    job.loop.controller.kp = 0.08;
    job.loop.controller.ki = 1.5;
    return job;
}

inline std::vector<double> velocity_of(const EffectJob& job, const EffectModel& model) {
    std::vector<double> w(job.record.input.size());
    simulate_effects(job, {&model, 1}, {}, {w.data()});
    return w;
}

inline EffectModel with(EffectModel m, Effect e, std::initializer_list<double> values) {
    m.add(e, values.begin());
    return m;
}

inline EffectModel with(EffectModel m, Effect e, const Values& values) {
    m.add(e, values.data());
    return m;
}

inline double most_apart(const std::vector<double>& a, const std::vector<double>& b) {
    double most = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
    return most;
}

// Neutral parameters are the identity, and their neighbourhood is next to it.
inline void check_neutral(const Sizes& s) {
    for (const LoopKind kind : {LoopKind::sampled, LoopKind::open, LoopKind::continuous}) {
        const std::vector<double> in = input_of(300, kind);
        const EffectJob job = job_of(in, kind);
        const EffectModel plain{table_three(), {}};
        const std::vector<double> linear = velocity_of(job, plain);
        Values neutral = neutral_of(s, s.slight);
        if (s.effect == effect<ExtraResonance>) neutral[2] = neutral[0];
        CHECK(velocity_of(job, with(plain, s.effect, neutral)) == linear);
        const double most = most_apart(velocity_of(job, with(plain, s.effect, s.slight)), linear);
        if (!(most < 1e-8)) check::fail(__FILE__, __LINE__, std::string(s.info().name) + ": " + std::to_string(most));
    }
}

// Lanes give what the scalar loop does, bit for bit, with every instruction set; with and without a position in the record.
inline void check_lanes(std::span<const EffectModel> models, std::initializer_list<LoopKind> kinds) {
    const std::vector<double> r = staircase(200);
    for (const LoopKind kind : kinds)
        for (const bool position : {false, true}) {
            EffectJob job = job_of(r, kind);
            if (position) job.record.position = r;
            const std::size_t n = models.size() * r.size();
            std::vector<double> w(n), u(n), a(n), lanes_w(n), lanes_u(n), lanes_a(n);
            job.lanes = false;
            simulate_effects(job, models, {}, {w.data(), u.data(), a.data()});
            job.lanes = true;
            for (const char* name : {"baseline", "avx2", "avx512"}) {
                job.kernel = effects_named(name);
                if (job.kernel == nullptr) continue;
                job.workers = 2;
                simulate_effects(job, models, {}, {lanes_w.data(), lanes_u.data(), lanes_a.data()});
                CHECK(lanes_w == w);
                CHECK(lanes_u == u);
                CHECK(lanes_a == a);
            }
        }
}

// A record that starts in motion continues the linear loop's own state; nothing: models with effects that do next to nothing.
// digits: of the velocity, in the closed loops and in the open one, whose torque is the staircase itself.
inline void check_motion(std::span<const EffectModel> nothing, double closed, double open) {
    const std::vector<double> r = staircase(200);
    const double state[] = {20.0, 0.3, -0.02, 0.2};
    const double* const start = state;
    for (const LoopKind kind : {LoopKind::sampled, LoopKind::open, LoopKind::continuous}) {
        EffectJob job = job_of(r, kind);
        if (kind == LoopKind::open) job.record.torque_before = r[0];
        std::vector<double> linear(r.size()), w(r.size());
        const EffectModel plain{table_three(), {}};
        simulate_effects(job, {&plain, 1}, {&start, 1}, {linear.data()});
        for (const EffectModel& m : nothing) {
            simulate_effects(job, {&m, 1}, {&start, 1}, {w.data()});
            CHECK(most_apart(w, linear) < (kind == LoopKind::open ? open : closed));
        }
    }
}

}  // namespace gaident::cases
