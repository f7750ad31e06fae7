// The engine on problems that need no simulator: ones are counted.
#include "check.hpp"
#include "gaident/search/species.hpp"

#include <bit>
#include <map>
#include <mutex>

using namespace gaident;

namespace {

// The fields of a chromosome begin at these bits.
std::vector<Word> starts_at(int bits, int every) {
    std::vector<Word> starts(static_cast<std::size_t>(words_for(bits)));
    for (int i = 0; i < bits; i += every) set_bit(starts.data(), i, true);
    return starts;
}

int ones(const Word* c, int first, int last) {
    int n = 0;
    for (int i = first; i < last; ++i) n += get_bit(c, i) ? 1 : 0;
    return n;
}

// Costs by a function of one chromosome.
class Evaluated final : public Evaluator {
public:
    explicit Evaluated(std::function<double(const Word*)> cost) : cost_(std::move(cost)) {}
    void evaluate(const Population& all, std::span<double> costs) override {
        for (std::size_t i = 0; i < all.size(); ++i) costs[i] = cost_(all[i]);
    }

private:
    std::function<double(const Word*)> cost_;
};

// cost = number of zeros
class Ones final : public Objective {
public:
    explicit Ones(int bits) : bits_(bits), starts_(starts_at(bits, 10)) {}
    Layout layout() const override { return {bits_, 0, starts_}; }
    std::unique_ptr<Evaluator> evaluator(std::size_t) const override {
        return std::make_unique<Evaluated>([this](const Word* c) { return static_cast<double>(bits_ - ones(c, 0, bits_)); });
    }

private:
    int bits_;
    std::vector<Word> starts_;
};

// Eight fields of four bits: a field of ones costs nothing, any other 1 more than it has ones, so that a climber goes to the
// zeros and stays there.
// Whole fields that are right have to come from either parent.
class Trap final : public Objective {
public:
    Layout layout() const override { return {fields * 4, 0, starts_}; }
    std::unique_ptr<Evaluator> evaluator(std::size_t) const override {
        return std::make_unique<Evaluated>([](const Word* c) {
            int cost = 0;
            for (int f = 0; f < fields; ++f) {
                const int n = ones(c, 4 * f, 4 * f + 4);
                cost += n == 4 ? 0 : n + 1;
            }
            return static_cast<double>(cost);
        });
    }
    static constexpr int fields = 8;

private:
    std::vector<Word> starts_ = starts_at(fields * 4, 4);
};

// A point of a local search: which of its species' bits are ones.
struct Point {
    std::size_t species = 0;
    std::vector<bool> bits;
    double cost = worst_cost;
    int iterations = 0;
};

// Species s = 0..3 has 12 (s + 1) bits.
// What it lacks to the true species, 2, costs it 20 a step, and every zero costs 1: the optimum of species s costs 10 + 20 max(0,
// 2 - s).
// An iteration of the local search makes one zero a one.
class Towers final : public SpeciesObjective<Point> {
public:
    explicit Towers(std::size_t smallest = 0, bool long_one = false, double least = 0.0) : long_(long_one), least_(least) {
        for (int s = 0; s < 4; ++s) species_.push_back({s, static_cast<std::size_t>(s) >= smallest});
    }
    static constexpr int species_bits = 2, bits_per_level = 12;
    static int size(std::size_t s) { return bits_per_level * static_cast<int>(s + 1); }
    static double optimum(std::size_t s) { return 10.0 + (s < 2 ? 20.0 * static_cast<double>(2 - s) : 0.0); }
    static std::size_t species_of(const Word* c) { return get_field(c, 0, species_bits); }

    Layout layout() const override { return {species_bits + size(3), species_bits, starts_}; }
    std::unique_ptr<Evaluator> evaluator(std::size_t) const override {
        return std::make_unique<Evaluated>([this](const Word* c) {
            const std::size_t s = species_of(c);
            const std::lock_guard<std::mutex> guard(lock_);
            ++evaluated_[s];
            return optimum(s) + size(s) - ones(c, species_bits, species_bits + size(s));
        });
    }
    std::span<const Species> species() const override { return species_; }
    void set_species(Word* c, std::size_t s) const override { set_field(c, 0, species_bits, static_cast<std::uint32_t>(s)); }
    bool leads_to(std::size_t small, std::size_t large) const override { return small + 1 == large; }

    Point start(const Word* c) const override {
        Point p{species_of(c), {}, worst_cost, 0};
        for (int i = 0; i < size(p.species); ++i) p.bits.push_back(get_bit(c, species_bits + i));
        return p;
    }
    std::vector<Point> enlarged(const Point& from, std::size_t to, std::size_t count) const override {
        Point p{to, from.bits, worst_cost, 0};
        p.bits.resize(static_cast<std::size_t>(size(to)), false);
        return std::vector<Point>(std::min<std::size_t>(count, 1), p);
    }
    Point reduced(const Point& from, std::size_t to) const override {
        Point p{to, from.bits, worst_cost, 0};
        p.bits.resize(static_cast<std::size_t>(size(to)));
        return judged(p);
    }
    Point improved(const Point& from, int iterations) const override {
        Point p = from;
        for (int k = 0; k < iterations; ++k, ++p.iterations) {
            const auto zero = std::find(p.bits.begin(), p.bits.end(), false);
            if (zero != p.bits.end()) *zero = true;
        }
        return judged(p);
    }
    bool is_long() const override { return long_; }
    double least_expected() const override { return least_; }

    // Chromosomes evaluated so far, by species.
    std::map<std::size_t, int> evaluated() const {
        const std::lock_guard<std::mutex> guard(lock_);
        return evaluated_;
    }

private:
    static Point judged(Point p) {
        p.cost = optimum(p.species) + static_cast<double>(std::count(p.bits.begin(), p.bits.end(), false));
        return p;
    }

    std::vector<Species> species_;
    std::vector<Word> starts_ = starts_at(species_bits + size(3), 2);
    bool long_;
    double least_;
    mutable std::mutex lock_;
    mutable std::map<std::size_t, int> evaluated_;
};

Settings of(int population, int generations, int elites = 0) {
    Settings s;
    s.population = population;
    s.generations = generations;
    s.elites = elites;
    return s;
}

bool same(const Trial& a, const Trial& b) {
    return a.history == b.history && a.best_fitness == b.best_fitness && a.best_generation == b.best_generation &&
           a.best == b.best && a.evaluations == b.evaluations && a.overflows == b.overflows;
}

bool same(const SpeciesTrial<Point>& a, const SpeciesTrial<Point>& b) {
    bool equal = same(static_cast<const Trial&>(a), b) && a.species.size() == b.species.size();
    for (std::size_t i = 0; equal && i < a.species.size(); ++i)
        equal = a.species[i].species == b.species[i].species && a.species[i].bits == b.species[i].bits &&
                a.species[i].cost == b.species[i].cost && a.species[i].iterations == b.species[i].iterations;
    return equal;
}

std::vector<Trial> searched(const Objective& objective, const Settings& s, int trials, std::uint64_t seed, int workers = 1) {
    Workers all(workers);
    Progress progress;
    return search(objective, s, trials, seed, {all, progress});
}

std::vector<SpeciesTrial<Point>> towers(const Towers& objective, const Settings& s, int trials, std::uint64_t seed,
                                        int workers = 1) {
    Workers all(workers);
    Progress progress;
    return search_species<Point>(objective, s, trials, seed, {all, progress});
}

}  // namespace

TEST_CASE("counting: finds all ones of 130 bits, far more than are right by chance") {
    const Ones ones_of_130(130);
    for (const Trial& t : searched(ones_of_130, of(50, 400, 1), 4, 1)) {
        CHECK(t.history.front() > 40.0);  // 65 zeros on average, 45 in the best of 50 once in a hundred thousand
        CHECK(t.best_fitness == 0.0);
        CHECK(ones(t.best.data(), 0, 130) == 130);
        CHECK(t.evaluations == 50 * 400 && t.overflows == 0);
        CHECK(t.history[static_cast<std::size_t>(t.best_generation)] == 0.0);
    }
}

TEST_CASE("counting: whole fields of a deceptive problem are put together from two parents") {
    const auto solved = [](double crossover) {
        Settings s = of(800, 150, 2);
        s.tournament = 4;
        s.mutation = 0.001;
        s.crossover = crossover;
        int n = 0;
        for (const Trial& t : searched(Trap(), s, 10, 3)) n += t.best_fitness == 0.0 ? 1 : 0;
        return n;
    };
    CHECK(solved(0.9) >= 5);
    CHECK(solved(0.0) == 0);  // from the zeros, to which selection leads, no single bit leads on
}

TEST_CASE("counting: with an elite the least cost never rises, without it does; the best ever seen is reported") {
    for (const int elites : {0, 1, 3}) {
        bool rose = false;
        for (const Trial& t : searched(Ones(130), of(20, 100, elites), 3, 5)) {
            for (std::size_t i = 1; i < t.history.size(); ++i) rose = rose || t.history[i] > t.history[i - 1];
            CHECK(t.best_fitness == *std::min_element(t.history.begin(), t.history.end()));
            CHECK(130 - ones(t.best.data(), 0, 130) == static_cast<int>(t.best_fitness));
        }
        CHECK(rose == (elites == 0));
    }
}

TEST_CASE("counting: same seed, same result on 1, 2 and 4 threads; a trial does not depend on the others") {
    const auto first = searched(Ones(130), of(30, 60), 5, 11);
    for (const int workers : {2, 4}) {
        const auto again = searched(Ones(130), of(30, 60), 5, 11, workers);
        for (std::size_t i = 0; i < 5; ++i) CHECK(same(again[i], first[i]));
    }
    CHECK(same(searched(Ones(130), of(30, 60), 1, 11)[0], first[0]));
    CHECK(!same(first[0], first[1]));
    CHECK(!same(searched(Ones(130), of(30, 60), 1, 12)[0], first[0]));
}

TEST_CASE("counting: the machine's random words and the plain ones make the same run") {
    Workers all(1);
    Progress progress;
    const auto counted = [](std::uint64_t base, std::uint64_t* out, std::size_t n) {
        for (std::size_t i = n; i-- > 0;) out[i] = mix(base + i * golden_gamma);
    };
    const auto plain = search(Ones(70), of(30, 40), 1, 2, {all, progress});
    const auto other = search(Ones(70), of(30, 40), 1, 2, {all, progress, nullptr, counted});
    CHECK(same(plain[0], other[0]));
}

TEST_CASE("counting: every species reaches its optimum; the progress names the leader") {
    const Towers objective;
    Workers all(1);
    Progress progress;
    Settings s = of(24, 40);
    s.round = 20;
    const auto t = search_species<Point>(objective, s, 1, 7, {all, progress})[0];
    CHECK(t.species.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(t.species[i].species == i);
        CHECK(t.species[i].bits.size() == static_cast<std::size_t>(Towers::size(i)));
    }
    CHECK(t.species[2].cost == 10.0 && t.species[3].cost == 10.0);
    // A species that cannot win is left where its first starts ended, or gets what a larger one lends: never better than its
    // optimum.
    for (std::size_t i = 0; i < 2; ++i) CHECK(t.species[i].cost >= Towers::optimum(i) && t.species[i].cost < worst_cost);
    CHECK(progress.species == 4 && progress.leading == 2);
    CHECK(progress.best == t.best_fitness && progress.done == t.history.size());
    for (std::size_t i = 1; i < t.history.size(); ++i) CHECK(t.history[i] <= t.history[i - 1]);
}

TEST_CASE("counting: breeding leaves the species of every individual alone, and shares the population evenly") {
    const Towers objective;
    Settings s = of(26, 30);
    s.mutation = 0.3;
    s.round = 30;
    const auto t = towers(objective, s, 1, 9)[0];
    const auto evaluated = objective.evaluated();
    CHECK(t.evaluations == 26 * 30);
    CHECK(evaluated.size() == 4 && evaluated.at(0) == 7 * 30 && evaluated.at(1) == 7 * 30);
    CHECK(evaluated.at(2) == 6 * 30 && evaluated.at(3) == 6 * 30);
}

TEST_CASE("counting: species that only lead to others are searched and not reported") {
    const Towers objective(2);
    const auto t = towers(objective, of(20, 20), 1, 4)[0];
    CHECK(t.species.size() == 2);
    CHECK(t.species[0].species == 2 && t.species[0].cost == 10.0);
    CHECK(t.species[1].species == 3 && t.species[1].cost == 10.0);
    CHECK(objective.evaluated().size() == 4);
    // The best chromosome is of a species that was asked for.
    CHECK(Towers::species_of(t.best.data()) >= 2);
}

TEST_CASE(
    "counting: a search ends after the round that reaches what is expected, and otherwise where rounds find nothing better") {
    Settings s = of(20, 1000);
    s.round = 10;
    CHECK(towers(Towers(0, false, 10.0), s, 1, 4)[0].history.size() == 10);
    s.quiet_rounds = 3;
    CHECK(towers(Towers(0, false, 10.0), s, 1, 4)[0].history.size() == 30);
    CHECK(towers(Towers(), s, 1, 4)[0].history.size() == 40);  // the first round is quick, and does not count
    s.generations = 25;
    CHECK(towers(Towers(), s, 1, 4)[0].history.size() == 25);
}

TEST_CASE("counting: on islands, too, the result is the same on 1, 2 and 4 threads") {
    Settings s = of(24, 40);
    s.round = 10;
    const auto first = towers(Towers(1, true), s, 2, 21);
    for (const int workers : {2, 4}) {
        const auto again = towers(Towers(1, true), s, 2, 21, workers);
        for (std::size_t i = 0; i < 2; ++i) CHECK(same(again[i], first[i]));
    }
    CHECK(first[0].species.size() == 3 && first[0].species[1].cost == 10.0);
    // One island per species has random words of its own: another run than all on one.
    CHECK(!same(towers(Towers(1, false), s, 1, 21)[0], first[0]));
}

TEST_CASE("counting: the stop flag ends a search that would go on for hours, on one thread and on two") {
    for (const int workers : {1, 2})
        for (const bool with_species : {false, true}) {
            std::atomic<bool> stop{false};
            Workers all(workers);
            Progress progress;
            const Towers objective(0, true);
            std::thread user([&] {
                // Islands are bred one after the other, and the progress counts the generations of the last: evaluations do for it.
                const auto bred = [&] { return with_species ? !objective.evaluated().empty() : progress.done >= 50; };
                while (!bred()) std::this_thread::yield();
                stop = true;
            });
            Settings s = of(20, 10000000);
            s.round = s.quiet_rounds = 10000000;
            const Resources resources{all, progress, &stop};
            if (with_species) CHECK_THROWS(search_species<Point>(objective, s, 2, 1, resources), Stopped);
            else CHECK_THROWS(search(Ones(130), s, 2, 1, resources), Stopped);
            user.join();
            CHECK(progress.done < 10000000);
            for (const auto& [species, count] : objective.evaluated()) CHECK(count < 10000000);  // no island ended its round
        }
}

TEST_CASE("counting: settings that make no sense are refused before anything is evaluated") {
    const Towers objective;
    CHECK_THROWS(towers(objective, of(1, 10), 1, 1), std::invalid_argument);
    CHECK_THROWS(towers(objective, of(20, 0), 1, 1), std::invalid_argument);
    CHECK_THROWS(towers(objective, of(20, 10), 0, 1), std::invalid_argument);
    CHECK_THROWS(searched(Ones(10), of(20, 10, 20), 1, 1), std::invalid_argument);
    CHECK(objective.evaluated().empty());
}
