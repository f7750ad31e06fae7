// Effects at the load of two masses: the registry, the friction of both ends solved together, lanes against scalar, standstill.
// Accuracy against an independent integrator is tested in tests/python/models/test_sides.py.
#include "../../csrc/gaident/nonlinear/effect_batch.hpp"
#include "../../csrc/gaident/plant/roots.hpp"

#include "check.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace gaident;

namespace {

constexpr double Ts = 1e-3;

Factors<double> table_three(double f = 1.0) {
    const std::complex<double> poles[] = {-16.11, {-13.53, 172.14 * f}, {-13.53, -172.14 * f}};
    const std::complex<double> zeros[] = {{-6.88, 66.38}, {-6.88, -66.38}};
    return factors_from_roots(9803.92, poles, zeros);
}

struct Sizes {
    const char* name;
    double typical[5], slight[5];
};

const Sizes sizes[] = {
    {"coulomb_friction", {0.05}, {1e-14}},
    {"stribeck_friction", {0.04, 0.07, 2.0}, {1e-14, 2e-14, 2.0}},
    {"asymmetric_friction", {0.05, 0.035, 1e-4, 4e-4}, {1e-14, 1e-14, 1e-16, 1e-16}},
    {"presliding_friction", {0.05, 3.0}, {1e-14, 3.0}},
    {"lugre_friction", {0.04, 0.07, 2.0, 10.0, 0.005}, {1e-14, 2e-14, 2.0, 10.0, 1e-16}},
    {"quadratic_drag", {1.5e-5}, {1e-18}},
    {"load_torque", {0.03}, {1e-14}},
    {"unbalance", {0.05, 0.3}, {1e-14, 0.3}},
    {"cogging", {0.03, 12.0, 0.4}, {1e-14, 12.0, 0.4}},
    {"friction_drift", {0.05, -0.2}, {1e-14, -0.2}},
    {"load_dependent_friction", {0.04, 0.2}, {1e-14, 1e-14}},
};

Effect at_load(const char* name) { return effect_named(std::string(name) + "@load"); }

std::vector<double> staircase(std::size_t n, double scale = 1.0) {
    const double level[] = {3.0, -5.0, 20.0, 1.0, -40.0, 10.0, 0.0, -2.0, 60.0, -60.0};
    std::vector<double> r(n);
    for (std::size_t k = 0; k < n; ++k) r[k] = scale * level[k * 10 / n];
    return r;
}

EffectJob job_of(std::span<const double> input, LoopKind kind) {
    EffectJob job;
    job.record.input = input;
    job.record.sample_time = Ts;
    job.record.top_speed = 60.0;
    job.loop.kind = kind;
    job.loop.controller.kp = 0.08;
    job.loop.controller.ki = 1.5;
    return job;
}

std::vector<double> velocity_of(const EffectJob& job, const EffectModel& model) {
    std::vector<double> w(job.record.input.size());
    simulate_effects(job, {&model, 1}, {}, {w.data()});
    return w;
}

EffectModel with(EffectModel m, Effect e, std::initializer_list<double> values) {
    m.add(e, values.begin());
    return m;
}

double most_apart(const std::vector<double>& a, const std::vector<double>& b) {
    double most = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
    return most;
}

}  // namespace

TEST_CASE("every shaft effect is in the registry once more, at the load") {
    std::size_t shaft = 0;
    for (const EffectInfo& info : Effects::table) {
        if (info.place != Place::shaft) continue;
        ++shaft;
        const EffectInfo& there = info_of(at_load(info.name));
        CHECK(there.at_load && there.needs_two_masses && !info.at_load);
        CHECK(there.count() == info.count() && there.turns == info.turns);
        CHECK(std::any_of(std::begin(sizes), std::end(sizes), [&](const Sizes& s) { return s.name == std::string(info.name); }));
    }
    CHECK(static_cast<std::size_t>(effect_count) == std::size(Effects::table) + shaft);
    CHECK(shaft == std::size(sizes));
}

TEST_CASE("at the load, too, neutral parameters are the identity, and their neighbourhood is next to it") {
    for (const LoopKind kind : {LoopKind::sampled, LoopKind::open, LoopKind::continuous}) {
        const std::vector<double> in = staircase(300, kind == LoopKind::open ? 0.01 : 1.0);
        const EffectJob job = job_of(in, kind);
        const EffectModel plain{table_three(), {}};
        const std::vector<double> linear = velocity_of(job, plain);
        for (const Sizes& s : sizes) {
            const EffectInfo& info = info_of(at_load(s.name));
            EffectModel neutral = plain, slight = plain;
            double values[5];
            for (int i = 0; i < info.count(); ++i) {
                const double value = info.parameters[static_cast<std::size_t>(i)].neutral;
                values[i] = value == value ? value : s.slight[i];
            }
            neutral.add(at_load(s.name), values);
            slight.add(at_load(s.name), s.slight);
            CHECK(velocity_of(job, neutral) == linear);
            const double most = most_apart(velocity_of(job, slight), linear);
            if (!(most < 1e-8)) check::fail(__FILE__, __LINE__, std::string(info.name) + ": " + std::to_string(most));
        }
    }
}

TEST_CASE("effects at the load: lanes equal the scalar loop bit for bit, with every loop and instruction set") {
    const std::vector<double> r = staircase(200);
    std::vector<EffectModel> models;
    for (const Sizes& s : sizes)
        for (int i = 0; i < 3; ++i)
            for (const bool both : {false, true}) {
                double values[5];
                for (int k = 0; k < 5; ++k) values[k] = s.typical[k] * (1.0 + 0.03 * i);
                EffectModel m{table_three(1.0 + 0.01 * i), {}};
                m.add(at_load(s.name), values);
                if (both) m.add(effect_named(s.name), values);
                models.push_back(m);
            }
    for (int i = 0; i < 11; ++i) {  // all at once, with play in the coupling, more than one group of lanes
        EffectModel m{table_three(1.0 + 0.01 * i), {}};
        for (const Sizes& s : sizes) {
            m.add(at_load(s.name), s.typical);
            if (i < 6) m.add(effect_named(s.name), s.typical);
        }
        const double gap = 0.01;
        m.add(effect<Backlash>, &gap);
        models.push_back(m);
    }
    for (const LoopKind kind : {LoopKind::sampled, LoopKind::open, LoopKind::continuous, LoopKind::servo})
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

TEST_CASE("friction at both ends holds exactly, a wound-up shaft between them, and the load lets go above its level") {
    constexpr std::size_t n = 2000, release = 1900;
    std::vector<double> torque(n);
    for (std::size_t k = 0; k < n; ++k)
        torque[k] = k < 30 ? 0.3 : k < release ? (k < 800 ? 0.02 : 0.01) * std::sin(0.1 * static_cast<double>(k)) : 0.12;
    const EffectJob job = job_of(torque, LoopKind::open);
    const EffectModel model =
        with(with({table_three(), {}}, effect<CoulombFriction>, {0.05}), at_load("coulomb_friction"), {0.05});
    const std::vector<double> w = velocity_of(job, model);
    CHECK(*std::max_element(w.begin(), w.end()) > 5.0);
    for (std::size_t k = release - 500; k <= release; ++k) CHECK(w[k] == 0.0);
    CHECK(w[n - 1] > 0.5);
    // With friction at the load alone the motor swings on the shaft, clamped at its end.
    const std::vector<double> swings = velocity_of(job, with({table_three(), {}}, at_load("coulomb_friction"), {0.08}));
    double inertia = 0.0, stiffness = 0.0, offset = 0.0;
    TwoMasses m{};
    CHECK(two_masses_of(table_three(), m));
    inertia = m.JM;
    stiffness = m.KG;
    // J_M dw/dt + (D_M + D_G) w + K x = T with x' = w, while the load is held: the integral of w is the twist less its start.
    for (std::size_t k = release - 800; k < release; ++k) {
        double twist = 0.0;
        for (std::size_t i = release - 800; i < k; ++i) twist += 0.5 * Ts * (swings[i] + swings[i + 1]);
        const double slope = (swings[k + 1] - swings[k - 1]) / (2.0 * Ts);
        const double left = 0.5 * (torque[k] + torque[k - 1]) - inertia * slope - (m.DM + m.DG) * swings[k] - stiffness * twist;
        if (k == release - 800) offset = left;
        CHECK_NEAR(left, offset, 2e-4);
    }
}

TEST_CASE("the friction of both ends: the four cases of sticking and slipping, against the equations") {
    // w+ = free - B f, f in the level times the sign of w+, from rest: a linear complementarity problem of two unknowns.
    FrictionLaw<double> motor, load;
    motor.level_positive = motor.level_negative = 0.05;
    load.level_positive = load.level_negative = 0.08;
    int seen[4] = {};
    for (const double across : {0.001, 0.4, 0.9})  // of sqrt(beta_M beta_L); 1 is the limit
        for (int i = -30; i <= 30; ++i)
            for (int k = -30; k <= 30; ++k) {
                const double beta_M = 2.0, beta_L = 0.5, between = across;
                const FreeEnd<double> at_motor{0.0, 0.0071 * i, beta_M}, at_load{0.0, 0.0033 * k, beta_L};
                double w = 0.0, w_L = 0.0, f = 0.0, f_L = 0.0;
                for (int again = 0; again < (across > 0.01 ? 60 : 1); ++again)  // rounds that start where the last ended
                    under_friction_at_both(
                        at_motor, at_load, between, between, w, w_L, f, f_L,
                        [&](int, double free, double beta) { return velocity_under_friction(motor, 0.0, free, beta); },
                        [&](int, double free, double beta) { return velocity_under_friction(load, 0.0, free, beta); });
                const double digits = across > 0.01 ? 1e-9 : 3e-8;
                CHECK_NEAR(w, at_motor.w_free - beta_M * f - between * f_L, 1e-15);
                CHECK_NEAR(w_L, at_load.w_free - between * f - beta_L * f_L, digits);
                CHECK(std::abs(f) <= 0.05 + digits && std::abs(f_L) <= 0.08 + digits);
                if (w != 0.0) CHECK_NEAR(f, std::copysign(0.05, w), digits);
                if (w_L != 0.0) CHECK_NEAR(f_L, std::copysign(0.08, w_L), digits);
                ++seen[(w != 0.0 ? 1 : 0) + (w_L != 0.0 ? 2 : 0)];
            }
    for (const int times : seen) CHECK(times > 200);
}

TEST_CASE("effects at the load: a record that starts in motion continues the linear loop's own state") {
    const std::vector<double> r = staircase(200);
    const double state[] = {20.0, 0.3, -0.02, 0.2};
    const double* const start = state;
    for (const LoopKind kind : {LoopKind::sampled, LoopKind::open, LoopKind::continuous}) {
        const EffectJob job = job_of(r, kind);
        std::vector<double> linear(r.size()), w(r.size());
        const EffectModel plain{table_three(), {}};
        simulate_effects(job, {&plain, 1}, {&start, 1}, {linear.data()});
        const EffectModel m = with(plain, at_load("coulomb_friction"), {1e-14});
        simulate_effects(job, {&m, 1}, {&start, 1}, {w.data()});
        CHECK(most_apart(w, linear) < (kind == LoopKind::open ? 1e-7 : 1e-8));
    }
}

TEST_CASE("what makes no two masses gives undefined numbers with an effect at the load") {
    const std::vector<double> r = staircase(100);
    const EffectJob job = job_of(r, LoopKind::sampled);
    Factors<double> impossible = table_three();
    impossible.zero_pair[0] = {1.0, 0.0};  // no stiffness
    Factors<double> backwards = table_three();
    backwards.gain = -backwards.gain;
    for (const Factors<double>& g : {impossible, backwards})
        CHECK(!std::isfinite(velocity_of(job, with({g, {}}, at_load("coulomb_friction"), {0.05})).back()));
}
