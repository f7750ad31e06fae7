// The loop with effects: elementary functions, registry, neutral parameters, lanes against scalar, standstill.
// Accuracy against an independent integrator is tested in tests/python/models/test_effects.py.
#include "effect_cases.hpp"

#include <set>

using namespace gaident;
using namespace gaident::cases;

namespace {

EffectModel model_with(const Factors<double>& g, Effect e, std::initializer_list<double> values) {
    return with({g, {}}, e, values);
}

// Whether an effect acts in the coupling of two masses, or is a resonance of its own.
bool of_a_shaft(const Sizes& s) {
    return s.info().place == Place::coupling || s.info().place == Place::plant;
}

}  // namespace

TEST_CASE("elementary functions agree with libm") {
    for (int i = 0; i <= 4000; ++i) {
        const double y = 0.0125 * i, x = 0.05 * (i - 2000);
        CHECK_NEAR(exp_of_minus(y) / std::exp(-y), 1.0, 1e-10);
        CHECK_NEAR(sine(x), std::sin(x), 2e-13);
        CHECK_NEAR(cosine(x), std::cos(x), 2e-13);
        CHECK(nearest(x * 7.3) == std::nearbyint(x * 7.3));
        CHECK(absolute(x) == std::abs(x));
    }
    CHECK(exp_of_minus(0.0) == 1.0);
    CHECK(exp_of_minus(1e9) < 1e-300);
}

TEST_CASE("the registry: names are unique, the enumeration has the table's order, every simulated effect is tested here") {
    std::set<std::string> names;
    for (const EffectInfo& info : effect_table) {
        CHECK(names.insert(info.name).second);
        CHECK(info.count() >= 1);
    }
    CHECK(std::string(effect_table[static_cast<std::size_t>(effect<Backlash>)].name) == "backlash");
    CHECK(std::string(effect_table[static_cast<std::size_t>(effect<VelocityFilter>)].name) == "velocity_filter");
    CHECK(static_cast<int>(effect<Outliers>) + 1 == Effects::size);
    std::size_t simulated = 0;
    for (const EffectInfo& info : Effects::table) simulated += info.simulated;
    CHECK(simulated == std::size(sizes));
    for (const Sizes& s : sizes) {
        CHECK(!s.info().neutral(s.typical.data()));
        CHECK(s.info().neutral(neutral_of(s, {1.0, 1.0, 1.0, 1.0, 1.0}).data()));
    }
}

TEST_CASE("neutral parameters are the identity, and their neighbourhood is next to it") {
    for (const Sizes& s : sizes) check_neutral(s);
}

TEST_CASE("lanes equal the scalar loop bit for bit, with every effect, loop and instruction set") {
    std::vector<EffectModel> models;
    for (const Sizes& s : sizes)
        for (int i = 0; i < 3; ++i)
            models.push_back(with({table_three(1.0 + 0.01 * i), {}}, s.effect, scaled(s.typical, 1.0 + 0.03 * i)));
    for (int i = 0; i < 11; ++i) {  // several at once, more than one group of lanes
        EffectModel m{one_mass(5e-4 * (1.0 + 0.02 * i)), {}};
        for (const Sizes& s : sizes)
            if (!of_a_shaft(s)) m.add(s.effect, s.typical.data());
        models.push_back(m);
    }
    check_lanes(models, {LoopKind::sampled, LoopKind::open, LoopKind::continuous});
}

TEST_CASE("a simulation that is stopped says so") {
    const std::vector<double> r = staircase(200);
    const EffectModel model = model_with(table_three(), effect<CoulombFriction>, {0.05});
    const std::atomic<bool> stop{true};
    for (const LoopKind kind : {LoopKind::sampled, LoopKind::open, LoopKind::continuous}) {
        EffectJob job = job_of(r, kind);
        job.stop = &stop;
        CHECK_THROWS(velocity_of(job, model), Stopped);
    }
}

TEST_CASE("friction holds exactly: no creep, no ringing, and lets go above its level") {
    constexpr std::size_t n = 2000, release = 1900;
    std::vector<double> torque(n);
    for (std::size_t k = 0; k < n; ++k)
        torque[k] = k < 30 ? 0.3 : k < release ? 0.049 * std::sin(0.1 * static_cast<double>(k)) : 0.051;
    const EffectJob job = job_of(torque, LoopKind::open);
    for (const Factors<double>& g : {one_mass(), table_three()}) {
        const std::vector<double> w =
            velocity_of(job, model_with(g, effect<CoulombFriction>, {g.structure.q == 0 ? 0.05 : 0.0501}));
        CHECK(*std::max_element(w.begin(), w.end()) > 5.0);
        // Two masses: the load has to swing out first.
        for (std::size_t k = g.structure.q == 0 ? 250 : release - 50; k <= release; ++k) CHECK(w[k] == 0.0);
        CHECK(w[release + 1] > 0.0);
    }
    // With a static level the stop holds although the sliding level lies below the torque; once it moves there is less friction.
    const std::vector<double> w = velocity_of(job, model_with(one_mass(), effect<CoulombFriction>, {0.05}));
    const std::vector<double> s = velocity_of(job, model_with(one_mass(), effect<StribeckFriction>, {0.03, 0.0505, 0.02}));
    for (std::size_t k = 250; k <= release; ++k) CHECK(s[k] == 0.0);
    CHECK(s[n - 1] > w[n - 1]);
}

TEST_CASE("a stiff bristle does not ring, even in one step per sample") {
    std::vector<double> torque(300, 0.0);
    std::fill(torque.begin(), torque.begin() + 20, 0.08);
    EffectJob job = job_of(torque, LoopKind::open);
    job.substeps = 1;
    const std::vector<double> w = velocity_of(job, model_with(one_mass(1e-4, 0.001), effect<PreslidingFriction>, {0.05, 500.0}));
    CHECK(w[20] > 1.0);
    for (std::size_t k = 200; k < w.size(); ++k) CHECK(std::abs(w[k]) < 1e-9);
    int turns = 0;
    for (std::size_t k = 21; k < w.size(); ++k) turns += w[k] * w[k - 1] < 0.0 && std::abs(w[k]) > 0.02;
    CHECK(turns <= 2);
}

TEST_CASE("a stiff LuGre bristle is stable at any step, holds below its static level and slides at the level of motion") {
    constexpr std::size_t n = 600;
    for (const double damping : {0.1, 1.0})
        for (const double stiffness : {100.0, 1e3, 1e6}) {
            std::vector<double> torque(n, 0.065);  // below Ts
            std::fill(torque.begin() + 200, torque.begin() + 400, 0.09);
            std::fill(torque.begin() + 400, torque.end(), 0.0);
            EffectJob job = job_of(torque, LoopKind::open);
            job.substeps = 1;
            const EffectModel model = model_with(one_mass(), effect<LugreFriction>, {0.04, 0.07, 2.0, stiffness, damping});
            const std::vector<double> w = velocity_of(job, model);
            for (std::size_t k = 150; k < 200; ++k) CHECK(std::abs(w[k]) < 1e-3);
            // Sliding: T = g(w) + D w + J dw/dt, D = 0.005, J = 5e-4
            const double v = w[399], g = 0.04 + 0.03 * std::exp(-(v / 2.0) * (v / 2.0));
            CHECK(v > 5.0);
            CHECK_NEAR(g + 0.005 * v + 5e-4 * (v - w[398]) / Ts, 0.09, 2e-4);
            for (std::size_t k = 560; k < n; ++k) CHECK(std::abs(w[k]) < 1e-3);
        }
}

TEST_CASE("two masses are recovered from the factors, with shaft damping") {
    const double DG = 0.002, JM = 1.02e-4, DM = 0.003, JL = 5.815e-4, DL = 0.008, KG = 2.59;
    Factors<double> g;
    g.structure = {1, 2};
    g.gain = 1.0 / JM;
    g.zero_pair[0] = {(DL + DG) / JL, KG / JL};
    const double a2 = (DM + DG) / JM + (DL + DG) / JL, a1 = KG * (1.0 / JM + 1.0 / JL) + (DM * DL + (DM + DL) * DG) / (JM * JL);
    const double a0 = (DM + DL) * KG / (JM * JL);
    double s = -(DM + DL) / (JM + JL);
    for (int i = 0; i < 50; ++i) s -= (((s + a2) * s + a1) * s + a0) / ((3.0 * s + 2.0 * a2) * s + a1);
    g.pole = -s;
    g.pole_pair[0] = {a2 + s, -a0 / s};
    TwoMasses m{};
    CHECK(two_masses_of(g, m));
    const double found[] = {m.JM, m.DM, m.JL, m.DL, m.KG, m.DG}, truth[] = {JM, DM, JL, DL, KG, DG};
    for (int i = 0; i < 6; ++i) CHECK_NEAR(found[i] / truth[i], 1.0, 1e-9);
}

TEST_CASE("a held torque delayed keeps its integral, whatever the fraction of a sample") {
    for (const double delay : {0.0, 0.1e-3, 0.25e-3, 0.3e-3, 1e-3, 1.73e-3, 4e-3})
        for (const int m : {1, 2, 4, 8}) {
            // The mean over a sample of a held ramp u(n) = n, `delay` late, is the ramp at the delayed time.
            double sum = 0.0;
            for (int j = 0; j < m; ++j) {
                int back = 0;
                double share = 0.0;
                TransportDelay::mean(delay, Ts, j, m, back, share);
                CHECK(share >= 0.0 && share <= 1.0 && back >= 0);
                sum += (1.0 - share) * (10.0 - back) + share * (11.0 - back);
            }
            CHECK_NEAR(sum / m, 10.0 - delay / Ts, 1e-9);
        }
}

TEST_CASE("a delay beyond the run is one by the run's length, however many samples it is") {
    for (const LoopKind kind : {LoopKind::sampled, LoopKind::open, LoopKind::continuous})
        for (const double sample_time : {4e-10, 1e-9, 1e-3}) {
            const std::vector<double> in(50, kind == LoopKind::open ? 0.1 : 40.0);
            EffectJob job = job_of(in, kind);
            job.record.sample_time = sample_time;
            const auto delayed = [&](double by) {
                return velocity_of(job, model_with(one_mass(), effect<TransportDelay>, {by}));
            };
            // The continuous loop is the linear one and the difference of two fine ones, which leaves what the bilinear rule does.
            if (kind != LoopKind::continuous)
                for (const double w : delayed(1.0)) CHECK(w == 0.0);
            CHECK(delayed(1.0) == delayed(50.0 * sample_time) && delayed(1.0) == delayed(50.7 * sample_time));
            CHECK(delayed(48.5 * sample_time).back() > 0.0);
        }
    // In the open loop all that acts is the torque before the record.
    const std::vector<double> in(50, 0.1), before(50, 0.02);
    EffectJob job = job_of(in, LoopKind::open), held = job_of(before, LoopKind::open);
    job.record.torque_before = 0.02;
    const std::vector<double> late = velocity_of(job, model_with(one_mass(), effect<TransportDelay>, {1.0}));
    CHECK(most_apart(late, velocity_of(held, model_with(one_mass(), effect<TransportDelay>, {1e-16}))) <= 1e-12);
    CHECK(late.back() > 0.1);
}

TEST_CASE("a run without an end keeps so many torques, and no more") {
    EffectRecord record;
    Loop open;
    PreparedEffects made;
    open.kind = LoopKind::open;
    record.sample_time = 1e-9;
    const auto prepared = [&] {
        prepare_effects(model_with(one_mass(), effect<TransportDelay>, {1.0}), record, open, 1, nullptr, made);
        return made.tables.of<TransportDelay>().back[0];
    };
    CHECK(prepared() == 1000000000);
    record.sample_time = 4e-10;
    CHECK_THROWS(prepared(), std::invalid_argument);
}

TEST_CASE("what is no drive gives undefined numbers and no crash") {
    const std::vector<double> r = staircase(100);
    const EffectJob job = job_of(r, LoopKind::sampled);
    Factors<double> backwards = one_mass();
    backwards.gain = -backwards.gain;
    const auto undefined = [&](const EffectModel& m) { return !std::isfinite(velocity_of(job, m).back()); };
    CHECK(undefined(model_with(backwards, effect<CoulombFriction>, {0.05})));
    Factors<double> impossible = table_three();
    impossible.zero_pair[0] = {1.0, 0.0};  // no stiffness
    CHECK(undefined(model_with(impossible, effect<Backlash>, {0.01})));
    CHECK(undefined(model_with(one_mass(), effect<TransportDelay>, {std::nan("")})));
    CHECK(undefined(model_with(one_mass(), effect<TransportDelay>, {5.0})));
    CHECK(undefined(model_with(one_mass(), effect<LoadTorque>, {std::nan("")})));
    EffectModel all = model_with(one_mass(), effect<PreslidingFriction>, {-1.0, -2.0});
    for (const Sizes& s : sizes)
        if (s.info().place != Place::coupling)
            all = with(all, s.effect, scaled(s.typical, -1e3));
    velocity_of(job, all);
    const EffectModel p0{factors_from_roots(1.0, {}, {}), {}};
    EffectModel with_load = p0;
    const double load[] = {0.1};
    with_load.add(effect<LoadTorque>, load);
    CHECK_THROWS(velocity_of(job, with_load), std::invalid_argument);
}

TEST_CASE("a record that starts in motion continues the linear loop's own state") {
    const EffectModel nothing[] = {model_with(table_three(), effect<LoadTorque>, {1e-14}),
                                   model_with(table_three(), effect<Backlash>, {1e-15})};
    check_motion(nothing, 1e-8, 1e-7);
}

namespace {

// -d w and a level of dry friction, d and the level per model: what the core has itself, asked from outside.
class Outside : public OwnEffects {
public:
    std::vector<double> d, level;

    bool at(OwnPlace place) const override { return place == OwnPlace::torque || place == OwnPlace::friction; }
    void begin(std::span<const std::size_t> models, const OwnSignals& signals, double* answer) override {
        models_.assign(models.begin(), models.end());
        signals_ = signals;
        answer_ = answer;
    }
    void ask(OwnPlace place, double time) override {
        CHECK(time >= 0.0);
        for (std::size_t lane = 0; lane < models_.size(); ++lane)
            answer_[lane] = place == OwnPlace::torque ? -d[models_[lane]] * signals_.velocity[lane] : level[models_[lane]];
    }

private:
    std::vector<std::size_t> models_;
    OwnSignals signals_{};
    double* answer_ = nullptr;
};

// A share of the velocity command, per model.
class Share : public OwnEffects {
public:
    std::vector<double> share;

    bool at(OwnPlace place) const override { return place == OwnPlace::command; }
    void begin(std::span<const std::size_t> models, const OwnSignals& signals, double* answer) override {
        models_.assign(models.begin(), models.end());
        command_ = signals.command;
        answer_ = answer;
    }
    void ask(OwnPlace place, double time) override {
        CHECK(place == OwnPlace::command);
        CHECK(time >= 0.0);
        for (std::size_t lane = 0; lane < models_.size(); ++lane) answer_[lane] = share[models_[lane]] * command_[lane];
    }

private:
    std::vector<std::size_t> models_;
    double* command_ = nullptr;
    double* answer_ = nullptr;
};

}  // namespace

TEST_CASE("a command that the core does not know: as the input changed beforehand, none in the open loop") {
    const std::size_t count = 9;  // more than the lanes
    const double no_torque = 0.0;
    for (const LoopKind kind : {LoopKind::open, LoopKind::sampled}) {
        const std::vector<double> input = input_of(300, kind);
        EffectJob job = job_of(input, kind);
        job.substeps = 4;
        Share own;
        std::vector<EffectModel> models(count);
        for (std::size_t i = 0; i < count; ++i) {
            own.share.push_back(0.25 * static_cast<double>(i));
            models[i].linear = one_mass();
            models[i].add(effect<CoulombFriction>, &no_torque);
        }
        job.own = &own;
        std::vector<double> found(count * input.size());
        simulate_effects(job, models, {}, {found.data(), nullptr, nullptr});
        for (std::size_t i = 0; i < count; ++i) {
            std::vector<double> changed = input, expected(input.size());
            for (double& r : changed) r *= kind == LoopKind::open ? 1.0 : own.share[i];
            EffectJob plain = job_of(changed, kind);
            plain.substeps = 4;
            simulate_effects(plain, std::span(models).subspan(i, 1), {}, {expected.data(), nullptr, nullptr});
            double top = 0.0, off = 0.0;
            for (std::size_t k = 0; k < input.size(); ++k) {
                top = std::max(top, std::abs(expected[k]));
                off = std::max(off, std::abs(found[i * input.size() + k] - expected[k]));
            }
            CHECK(i == 0 || top > 0.1);
            CHECK(off <= 1e-12 * (1.0 + top));
        }
    }
}

TEST_CASE("effects that the core does not know: as its own, in lanes as alone") {
    const std::size_t count = 11;  // more than the lanes
    for (const LoopKind kind : {LoopKind::open, LoopKind::sampled, LoopKind::continuous}) {
        const std::vector<double> input = input_of(400, kind);
        EffectJob job = job_of(input, kind);
        job.substeps = 16;
        Outside own;
        std::vector<EffectModel> asked(count), known(count);
        for (std::size_t i = 0; i < count; ++i) {
            const double d = 0.002 * static_cast<double>(i % 4), Tc = 0.01 * static_cast<double>(i % 3);
            own.d.push_back(d);
            own.level.push_back(Tc);
            asked[i].linear = one_mass();
            known[i].linear = kind == LoopKind::continuous ? one_mass() : one_mass(5e-4, 0.005 + d);
            if (Tc > 0.0) known[i].add(effect<CoulombFriction>, &Tc);
            if (kind == LoopKind::continuous) own.d[i] = 0.0;
        }
        const auto run = [&](const std::vector<EffectModel>& models, OwnEffects* effects, bool lanes) {
            job.own = effects;
            job.lanes = lanes;
            std::vector<double> velocity(count * input.size());
            simulate_effects(job, models, {}, {velocity.data(), nullptr, nullptr});
            return velocity;
        };
        const std::vector<double> found = run(asked, &own, true), expected = run(known, nullptr, true);
        CHECK(found == run(asked, &own, false));
        double top = 0.0, off = 0.0;
        for (std::size_t k = 0; k < found.size(); ++k) {
            top = std::max(top, std::abs(expected[k]));
            off = std::max(off, std::abs(found[k] - expected[k]));
        }
        CHECK(top > 1.0);
        CHECK_NEAR(off / top, 0.0, 2e-4);  // the damping at the foreseen mean velocity, of second order
    }
}
