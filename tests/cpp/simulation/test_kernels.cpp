#include "check.hpp"
#include "gaident/genetic/population.hpp"
#include "gaident/simulation/batch.hpp"
#include "gaident/genetic/decode.hpp"
#include "gaident/reference/drives.hpp"

#include <cstring>

using namespace gaident;

namespace {

// One candidate's coefficients and states into a lane; a lower order than the group's is padded with zeros.
template <class T, int W>
void place(Group<T, W>& group, int lane, const Prepared& c) {
    const int n = c.response.order;
    for (int i = 0; i < group.order; ++i) {
        group.a[i][lane] = static_cast<T>(i < n ? c.response.a[i] : 0.0);
        group.x[i][lane] = static_cast<T>(i < n ? c.x[i] : 0.0);
    }
    for (int i = 0; i <= group.order; ++i) group.b[i][lane] = static_cast<T>(i <= n ? c.response.b[i] : 0.0);
    group.s[lane] = static_cast<T>(c.s);
}

std::vector<const Kernels*> available() {
    std::vector<const Kernels*> all;
    for (const char* name : {"baseline", "avx2", "avx512"})
        if (const Kernels* k = kernels_named(name)) all.push_back(k);
    return all;
}

template <class T>
struct In;
template <>
struct In<double> {
    using Group = DoubleGroup;
    static const auto& set(const Kernels& k) { return k.in_double; }
};
template <>
struct In<float> {
    using Group = FloatGroup;
    static const auto& set(const Kernels& k) { return k.in_float; }
};

// A group of drives that share command and loop, of orders up to `order` in any mixture but with one of that order at least.
template <class T>
struct Case {
    static constexpr int W = In<T>::Group::width;
    std::vector<reference::Drive> drives;
    std::vector<Prepared> prepared;
    Loop loop;
    double sample_time = 0.0;
    std::vector<T> input, output;
    typename In<T>::Group group;

    // `poles`: the largest p + q; the largest order of the group is one more where the loop is closed beforehand.
    Case(Random& random, int poles, bool stepped, std::size_t samples) {
        for (int lane = 0; lane < W; ++lane) {
            const auto n = static_cast<std::size_t>(
                lane == 0 || poles == 0 ? poles : 1 + static_cast<int>(random.below(static_cast<std::uint32_t>(poles))));
            const std::size_t q_most = std::min<std::size_t>(n / 2, 7), q_least = n > 7 ? n - 7 : 0;
            const std::size_t q = q_least + random.below(static_cast<std::uint32_t>(q_most - q_least + 1));
            drives.push_back(
                reference::random_drive(random, LoopKind::continuous, n - q, q, reference::Family::ordinary, samples));
        }
        // One loop for all lanes: every plant's gain is scaled so that its own loop gain stays.
        sample_time = drives[0].sample_time;
        loop = drives[0].loop;
        if (stepped) {
            const auto u = drives[0].template respond<double>().torque;
            const double largest = reference::deviation(u, std::vector<double>(u.size(), 0.0));
            loop.controller.torque_limit = 0.6 * largest;
            loop.controller.integrator_limit = 0.4 * largest;
        }
        for (reference::Drive& d : drives) {
            // The bilinear recurrence depends on roots times Ts only.
            const double time = d.sample_time / sample_time;
            for (auto* roots : {&d.plant.A1, &d.plant.A2, &d.plant.B2})
                for (auto& a : *roots) a *= time;
            const double own_kp = d.loop.controller.kp;
            for (std::size_t i = 0; i < d.plant.A1.size(); ++i) d.plant.K *= time;
            d.plant.K *= own_kp / loop.controller.kp;
            d.loop = loop;
            d.sample_time = sample_time;
            d.input = drives[0].input;
        }
        for (const double r : drives[0].input) input.push_back(static_cast<T>(r));
        for (std::size_t i = 0; i < samples; ++i) output.push_back(static_cast<T>(0.9 * drives[0].input[i]));
        Record record;
        record.input = record.output = drives[0].input;
        record.sample_time = sample_time;
        group.order = 0;
        for (const auto& d : drives) {
            prepared.push_back(prepare(d.factors(), record, loop, nullptr));
            group.order = std::max(group.order, prepared.back().response.order);
        }
        for (int lane = 0; lane < W; ++lane) place(group, lane, prepared[static_cast<std::size_t>(lane)]);
    }

    // One lane by the scalar recurrence.
    std::vector<T> scalar(int lane, bool stepped) const {
        const Prepared& c = prepared[static_cast<std::size_t>(lane)];
        T a[max_loop_order], b[max_loop_order + 1], x[max_loop_order] = {};
        const int n = c.response.order;
        for (int i = 0; i < n; ++i) a[i] = static_cast<T>(c.response.a[i]);
        for (int i = 0; i <= n; ++i) b[i] = static_cast<T>(c.response.b[i]);
        SteppedLoop<T, -1> steps{ControllerState<T>(loop.controller, Clock{sample_time})};
        std::vector<T> y;
        for (const T r : input) {
            T u;
            y.push_back(stepped ? steps.step(n, a, b, x, r, u) : recurrence_step<T, -1>(n, a, b, x, r));
        }
        return y;
    }
};

template <class T>
struct Results {
    std::vector<T> outputs, sums;
    typename In<T>::Group after;
};

// The group over all samples, in two calls, so that the states are carried over.
template <class T>
Results<T> run(const Kernels& kernels, const Case<T>& c, bool stepped) {
    constexpr std::size_t W = In<T>::Group::width;
    const auto& set = In<T>::set(kernels);
    const ControllerState<T> pi(c.loop.controller, Clock{c.sample_time});
    const std::size_t n = c.input.size(), cut = n / 3;
    Results<T> r;
    r.outputs.resize(n * W);
    r.sums.resize(W);
    r.after = c.group;
    const T *const in = c.input.data(), *const out = c.output.data();
    if constexpr (std::same_as<T, double>) {
        if (stepped) {
            set.stepped_outputs(r.after, pi, in, cut, r.outputs.data());
            set.stepped_outputs(r.after, pi, in + cut, n - cut, r.outputs.data() + cut * W);
            auto again = c.group;
            set.stepped_errors(again, pi, in, out, n, r.sums.data());
        }
    }
    if (!stepped) {
        set.outputs(r.after, in, cut, r.outputs.data());
        set.outputs(r.after, in + cut, n - cut, r.outputs.data() + cut * W);
        auto again = c.group;
        set.errors(again, in, out, n, r.sums.data());
    }
    return r;
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

template <class T>
void compare(bool stepped, double tolerance) {
    constexpr int W = In<T>::Group::width;
    Random random(stepped ? 81 : 82);
    double worst = 0.0;
    for (int poles = 0; poles <= max_plant_order; ++poles)
        for (int repeat = 0; repeat < 2; ++repeat) {
            const Case<T> c(random, poles, stepped, 200);
            CHECK(c.group.order == poles + (stepped ? 0 : 1));
            const Results<T> first = run(*available()[0], c, stepped);
            for (int lane = 0; lane < W; ++lane) {
                std::vector<T> y;
                T sum = 0;
                for (std::size_t i = 0; i < c.input.size(); ++i) {
                    y.push_back(first.outputs[i * W + static_cast<std::size_t>(lane)]);
                    const T e = c.output[i] - y[i];
                    sum = gaident::fma(e, e, sum);
                }
                CHECK(same_bits(y, c.scalar(lane, stepped)));
                CHECK(sum == first.sums[static_cast<std::size_t>(lane)]);
                const auto exact = c.drives[static_cast<std::size_t>(lane)].template respond<long double>().velocity;
                const double own =
                    reference::deviation(c.drives[static_cast<std::size_t>(lane)].template respond<double>().velocity, exact);
                const Delta<double>& h = c.prepared[static_cast<std::size_t>(lane)].response;
                const bool held = std::same_as<T, double> || float_suffices(h.order, [&](int i) { return h.a[i]; });
                if (own < 1e-12 && held) worst = std::max(worst, reference::deviation(y, exact));
            }
            for (const Kernels* k : available()) {
                const Results<T> other = run(*k, c, stepped);
                CHECK(same_bits(other.outputs, first.outputs));
                CHECK(same_bits(other.sums, first.sums));
                for (int i = 0; i < c.group.order; ++i)
                    CHECK(std::memcmp(other.after.x[i], first.after.x[i], sizeof first.after.x[i]) == 0);
                if (stepped) CHECK(std::memcmp(other.after.s, first.after.s, sizeof first.after.s) == 0);
            }
        }
    std::printf("largest deviation from the referee, orders 0..15: %.2g\n", worst);
    CHECK(worst < tolerance);
}

}  // namespace

TEST_CASE("kernels: every available instruction set is found by its name, the best one among them") {
    bool best = false;
    for (const Kernels* k : available()) {
        std::printf("available: %s\n", k->name);
        best = best || k == &best_kernels();
        CHECK(kernels_named(k->name) == k);
    }
    CHECK(best);
    CHECK(kernels_named("baseline") == &baseline_kernels());
    CHECK(kernels_named("abacus") == nullptr);
    CHECK(&best_kernels() == available().back());
}

TEST_CASE("kernels: linear loop in double, equal bit for bit to the scalar, among each other, and to the referee") {
    compare<double>(false, 1e-9);
}
TEST_CASE("kernels: linear loop in float") { compare<float>(false, 1e-4); }
TEST_CASE("kernels: stepped loop with limits in double") { compare<double>(true, 1e-9); }

TEST_CASE("kernels: order 0 passes the input through its gain") {
    for (const Kernels* k : available()) {
        DoubleGroup g;
        g.order = 0;
        for (int lane = 0; lane < double_lanes; ++lane)
            place(g, lane, [&] {
                Prepared c;
                c.response.b[0] = lane + 1.0;
                return c;
            }());
        const double in[] = {1.0, -2.0, 0.5}, out[] = {0.0, 0.0, 0.0};
        double y[3 * double_lanes], sums[double_lanes];
        k->in_double.outputs(g, in, 3, y);
        k->in_double.errors(g, in, out, 3, sums);
        for (int lane = 0; lane < double_lanes; ++lane) {
            for (int i = 0; i < 3; ++i) CHECK(y[i * double_lanes + lane] == in[i] * (lane + 1.0));
            CHECK(sums[lane] == 5.25 * (lane + 1.0) * (lane + 1.0));
        }
    }
}

TEST_CASE("kernels: a lane that diverges does not touch its neighbours") {
    Random random(83);
    for (const Kernels* k : available()) {
        Case<double> c(random, 5, false, 200);
        const Results<double> calm = run(*k, c, false);
        c.prepared[3].response.a[0] = -5.0;  // grows by 6 in every sample
        place(c.group, 3, c.prepared[3]);
        c.input.resize(700, 1.0);
        c.output.resize(700, 1.0);
        const Results<double> wild = run(*k, c, false);
        CHECK(!(wild.sums[3] < std::numeric_limits<double>::max()));
        for (std::size_t i = 0; i < 200; ++i)
            for (std::size_t lane = 0; lane < double_lanes; ++lane)
                CHECK(lane == 3 || wild.outputs[i * double_lanes + lane] == calm.outputs[i * double_lanes + lane]);
    }
}

TEST_CASE("kernels: groups are loaded as prepare() does it, bit for bit, structures mixed where the loop lets them") {
    const char* sets[] = {"baseline", "avx2", "avx512"};
    Random random(11);
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open}) {
        const SearchRanges ranges{{1e3, 2e4}, {0.0, 60.0}, {0.0, 250.0}, 1, 3, 0, 3, 10};
        const Genome genome(ranges, Code::binary, Scale::linear);
        Population population(8, genome.words());
        for (int round = 0; round < 20; ++round) {
            random.words(population.flat().data(), population.flat().size());
            std::vector<Factors<double>> models;
            std::vector<const Factors<double>*> lanes;
            for (std::size_t i = 0; i < 8; ++i) {
                if (kind != LoopKind::continuous) genome.set_structure(population[i], 1 + round % 3, round % 4);
                models.push_back(decode(population[i], genome));
            }
            for (const auto& m : models) lanes.push_back(&m);
            const std::vector<double> input(20, 1.0);
            Experiment experiment;
            experiment.loop.kind = kind;
            experiment.loop.controller.kp = 0.1;
            experiment.loop.controller.ki = 5.0;
            Record record{input, input, 0.444e-3, round % 2 == 0 ? Start::rest : Start::steady, 3.0};
            for (const char* name : sets) {
                const Kernels* kernels = kernels_named(name);
                if (kernels == nullptr) continue;
                experiment.kernels = kernels;
                DoubleGroup group;
                load_group(experiment, record, lanes, {}, group);
                for (std::size_t i = 0; i < 8; ++i) {
                    const Prepared c = prepare(models[i], record, experiment.loop, nullptr);
                    const int n = c.response.order;
                    // Behind a hold the group doubles as often as its fastest lane needs, which moves the last digits.
                    const double tolerance = kind == LoopKind::continuous ? 0.0 : 1e-13;
                    for (int k = 0; k <= group.order; ++k) {
                        const double b = k <= n ? c.response.b[k] : 0.0;
                        CHECK(std::abs(group.b[k][i] - b) <= tolerance * std::abs(b) + tolerance * 1e-6);
                        if (k == group.order) continue;
                        const double a = k < n ? c.response.a[k] : 0.0;
                        CHECK(std::abs(group.a[k][i] - a) <= tolerance * std::abs(a) + tolerance * 1e-6);
                        CHECK(group.x[k][i] == (k < n ? c.x[k] : 0.0));
                    }
                    CHECK(group.s[i] == c.s);
                }
            }
        }
    }
}

namespace {

// Many groups in one call, of rising order, the last one partly used: the sums of each group on its own, and of the scalar
// recurrence.
template <class T>
void compare_many() {
    using Group = typename In<T>::Group;
    constexpr int W = Group::width;
    Random random(84);
    const auto number = [&](double size) { return static_cast<T>(size * (random.uniform() - 0.5)); };
    for (int repeat = 0; repeat < 40; ++repeat) {
        const int count = 1 + static_cast<int>(random.below(6));
        const int lanes = (count - 1) * W + 1 + static_cast<int>(random.below(W));
        std::vector<Group> groups(static_cast<std::size_t>(count));
        int order = static_cast<int>(random.below(3));
        for (Group& g : groups) {
            g.order = order;
            for (int lane = 0; lane < W; ++lane) {
                for (int i = 0; i < order; ++i) g.a[i][lane] = number(0.3 / (1 + i)), g.x[i][lane] = number(2.0);
                for (int i = 0; i <= order; ++i) g.b[i][lane] = number(0.5);
            }
            if (random.below(2) == 0) order = std::min(order + static_cast<int>(random.below(6)), max_loop_order);
        }
        std::vector<T> input(90), output(90);
        for (T& v : input) v = number(10.0);
        for (T& v : output) v = number(10.0);
        std::vector<T> driven, settling;
        for (const Kernels* k : available()) {
            const auto& set = In<T>::set(*k);
            std::vector<T> sums(static_cast<std::size_t>(count * W)), free(sums.size());
            auto again = groups, third = groups;
            set.many_errors(again.data(), lanes, input.data(), output.data(), 50, sums.data());
            set.settling_errors(third.data(), lanes, output.data(), 90, free.data());
            for (int lane = 0; lane < lanes; ++lane) {
                const auto at = static_cast<std::size_t>(lane);
                Group g = groups[at / W];
                T own[W];
                set.errors(g, input.data(), output.data(), 50, own);
                CHECK(own[at % W] == sums[at]);
                for (int i = 0; i < g.order; ++i) CHECK(again[at / W].x[i][at % W] == g.x[i][at % W]);

                T a[max_loop_order], x[max_loop_order], sum = 0;
                for (int i = 0; i < g.order; ++i) a[i] = g.a[i][at % W], x[i] = groups[at / W].x[i][at % W];
                if (g.order == 0) x[0] = 0;
                for (const T y : output) {
                    const T e = y - recurrence_step<T, -1, false>(g.order, a, nullptr, x, T(0));
                    sum = gaident::fma(e, e, sum);
                }
                CHECK(sum == free[at]);
            }
            sums.resize(static_cast<std::size_t>(lanes));
            free.resize(static_cast<std::size_t>(lanes));
            if (driven.empty()) driven = sums, settling = free;
            CHECK(same_bits(driven, sums) && same_bits(settling, free));
        }
    }
}

}  // namespace

TEST_CASE("kernels: many groups side by side, driven and settling, give every lane its own sum, bit for bit") {
    compare_many<double>();
    compare_many<float>();
}

TEST_CASE("kernels: random words in bulk are the generator's, in every instruction set and any number") {
    for (const Kernels* k : available())
        for (std::size_t n = 0; n < 40; ++n) {
            Random bulk(5), single(5);
            bulk.words(std::vector<Word>(n + 1).data(), n);  // somewhere in the sequence
            for (std::size_t i = 0; i < n; ++i) single.word();
            std::vector<Word> words(n + 1, 7);
            k->words(bulk.skip(n), words.data(), n);
            for (std::size_t i = 0; i < n; ++i) CHECK(words[i] == single.word());
            CHECK(words[n] == 7 && bulk.word() == single.word());
            WordStream stream(Random(9), k->words);
            Random plain(9);
            for (int i = 0; i < 600; ++i) CHECK(stream.word() == plain.word());
        }
}
