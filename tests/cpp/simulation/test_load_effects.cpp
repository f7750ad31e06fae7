// Effects at the load of two masses: the registry, the friction of both ends solved together, lanes against scalar, standstill.
// Accuracy against an independent integrator is tested in tests/python/models/test_sides.py.
#include "effect_cases.hpp"

using namespace gaident;
using namespace gaident::cases;

namespace {

Effect at_load(const char* name) { return effect_named(std::string(name) + "@load"); }

}  // namespace

TEST_CASE("every shaft effect is in the registry once more, at the load") {
    std::size_t shaft = 0;
    for (const EffectInfo& info : Effects::table) {
        if (info.place != Place::shaft) continue;
        ++shaft;
        const EffectInfo& there = info_of(at_load(info.name));
        CHECK(there.at_load && there.needs_two_masses && !info.at_load);
        CHECK(there.count() == info.count() && there.turns == info.turns);
    }
    CHECK(static_cast<std::size_t>(effect_count) == std::size(Effects::table) + shaft);
    CHECK(shaft == sizes_at_load().size());
}

TEST_CASE("at the load, too, neutral parameters are the identity, and their neighbourhood is next to it") {
    for (const Sizes& s : sizes_at_load()) check_neutral(s);
}

TEST_CASE("effects at the load: lanes equal the scalar loop bit for bit, with every loop and instruction set") {
    const std::vector<Sizes> all = sizes_at_load();
    std::vector<EffectModel> models;
    for (const Sizes& s : all)
        for (int i = 0; i < 3; ++i) {
            const Values values = scaled(s.typical, 1.0 + 0.03 * i);
            models.push_back(with({table_three(1.0 + 0.01 * i), {}}, s.effect, values));
            models.push_back(with(models.back(), effect_named(s.info().name), values));
        }
    for (int i = 0; i < 11; ++i) {  // all at once, with play in the coupling, more than one group of lanes
        EffectModel m = with({table_three(1.0 + 0.01 * i), {}}, effect<Backlash>, {0.01});
        for (const Sizes& s : all) {
            m.add(s.effect, s.typical.data());
            if (i < 6) m.add(effect_named(s.info().name), s.typical.data());
        }
        models.push_back(m);
    }
    check_lanes(models, {LoopKind::sampled, LoopKind::open, LoopKind::continuous, LoopKind::servo});
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
    const EffectModel nothing = with({table_three(), {}}, at_load("coulomb_friction"), {1e-14});
    check_motion({&nothing, 1}, 1e-8, 1e-7);
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

TEST_CASE(
    "the load's motion: in lanes as alone, bit for bit, its angle the integral of its velocity; friction holds it exactly") {
    std::vector<EffectModel> models;
    for (int i = 0; i < 11; ++i) {  // more than one group of lanes, some without any effect
        EffectModel m{table_three(1.0 + 0.01 * i), {}};
        if (i % 3 == 1) m = with(m, effect<Backlash>, {0.01});
        if (i % 3 == 2) m = with(m, at_load("coulomb_friction"), {0.05});
        models.push_back(m);
    }
    const std::vector<double> r = staircase(400);
    for (const LoopKind kind : {LoopKind::sampled, LoopKind::open, LoopKind::continuous, LoopKind::servo}) {
        EffectJob job = job_of(r, kind);
        job.substeps = 8;
        const std::size_t n = models.size() * r.size();
        const auto motion = [&](bool lanes) {
            job.lanes = lanes;
            std::vector<double> w(n), w_load(n), lag(n);
            simulate_effects(job, models, {}, {w.data(), nullptr, nullptr, w_load.data(), lag.data()});
            return std::vector{w, w_load, lag};
        };
        const auto alone = motion(false);
        CHECK(alone == motion(true));
        if (kind == LoopKind::continuous) continue;  // the motor's velocity there is that of the bilinear loop
        double turned = 0.0, off = 0.0;
        for (std::size_t k = 1; k < n; ++k) {
            if (k % r.size() == 0) continue;
            const auto apart = [&](std::size_t at) { return alone[1][at] - alone[0][at]; };
            const double moved = alone[2][k] - alone[2][k - 1];
            turned = std::max(turned, std::abs(moved));
            off = std::max(off, std::abs(moved - 0.5 * Ts * (apart(k) + apart(k - 1))));
        }
        CHECK(turned > 1e-5);
        CHECK(off < 0.1 * turned);  // the trapezoidal rule at the corners of the torque
    }
    std::vector<double> torque(800);
    for (std::size_t k = 0; k < torque.size(); ++k) torque[k] = 0.03 * std::sin(0.1 * static_cast<double>(k));
    const EffectJob job = job_of(torque, LoopKind::open);
    const EffectModel held = with({table_three(), {}}, at_load("coulomb_friction"), {0.3});
    std::vector<double> w(torque.size()), w_load(torque.size()), lag(torque.size());
    simulate_effects(job, {&held, 1}, {}, {w.data(), nullptr, nullptr, w_load.data(), lag.data()});
    CHECK(*std::max_element(w.begin(), w.end()) > 0.1);
    for (std::size_t k = 0; k < torque.size(); ++k) CHECK(w_load[k] == 0.0);
}
