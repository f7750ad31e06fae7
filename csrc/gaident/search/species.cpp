#include "species.hpp"

#include "island.hpp"
#include "neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numeric>

namespace gaident {

std::vector<Structure> structures(const SearchRanges& r) {
    std::vector<Structure> all;
    for (int n = r.p_min + r.q_min; n <= r.p_max + r.q_max; ++n)
        for (int q = std::max(r.q_min, n - r.p_max); q <= std::min(r.q_max, n - r.p_min); ++q) all.push_back({n - q, q});
    return all;
}

namespace {

// How hard a species' optimum is looked for.
struct Effort {
    std::size_t grown;      // starts from each smaller structure
    int first;              // iterations that every start gets
    std::size_t promising;  // starts that get more
};
constexpr Effort quick{2, 2, 3}, thorough{5, 6, 10};
constexpr int more_iterations = 4, full_iterations = 40;
// Where the root mean square error is so many times the noise of the measured velocity, there may be a better optimum.
constexpr double down_to_noise = 1.2;
// How many islands the search of a long record has.
constexpr std::size_t most_islands = 4;
// Individuals that a species has at least: fewer cannot mate.
constexpr std::size_t least_in_species = 3;
// A structure whose error sum is so many times another one's of no larger size is not fitted to the end.
constexpr double out_of_reach = 2.0;
// A structure whose error sum is within so many times the least describes the data about as well as any.
constexpr double close_to_best = 1.2;
// What a better optimum leaves of the error sum, at most: less is the end of a valley, and no reason for another round.
constexpr double worth_a_round = 0.95;

// Power of white noise on a smooth signal, from its third differences (median, so robust), whose variance is 1 + 9 + 9 + 1 = 20 times
// the noise's. Of a long record an evenly spaced part will do.
double noise_power(std::span<const double> w) {
    constexpr std::size_t enough = 4096;
    const std::size_t stride = std::max<std::size_t>(1, w.size() / enough);
    std::vector<double> sizes;
    for (std::size_t n = 3; n < w.size(); n += stride)
        sizes.push_back(std::abs(w[n] - 3.0 * w[n - 1] + 3.0 * w[n - 2] - w[n - 3]));
    if (sizes.empty()) return 0.0;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return 1.4826 * 1.4826 * *middle * *middle / 20.0;
}

// The structures asked for and all smaller ones that lead to them. Those are fitted as well: from random starts alone the optimum of a
// structure with two resonances is rarely found, from the optimum of one resonance nearly always.
SearchRanges with_smaller(SearchRanges r) {
    r.p_min = std::min(r.p_min, 1);
    r.q_min = 0;
    return r;
}

class SpeciesRun {
public:
    SpeciesRun(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, Progress& progress)
        : experiment_(experiment),
          genome_(genome),
          settings_(settings),
          progress_(progress),
          all_(structures(with_smaller(genome.ranges()))),
          refiner_(experiment, options(genome, experiment.samples())) {
        places_.resize(all_.size());
        std::vector<std::size_t> asked, smaller;
        for (std::size_t i = 0; i < all_.size(); ++i) (is_asked(i) ? asked : smaller).push_back(i);
        // The number of islands depends on the data alone, never on the workers: the same seed has to give the same result.
        const std::size_t islands = experiment.is_long() ? std::min(most_islands, asked.size()) : 1;
        const std::size_t population = std::max(static_cast<std::size_t>(settings_.population), least_in_species * asked.size());
        for (std::size_t k = 0; k < islands; ++k) {
            const std::size_t first = k * asked.size() / islands, last = (k + 1) * asked.size() / islands;
            settle(genome_, std::span(asked).subspan(first, last - first),
                   (k + 1) * population / islands - k * population / islands, islands == 1 ? random : Random(random.word()));
        }
        asked_islands_ = islands_.size();
        if (!smaller.empty())
            settle(Genome(with_smaller(genome_.ranges()), settings_.code, settings_.roots), smaller,
                   least_in_species * smaller.size(), Random(random.word()));
        trial_.species.resize(all_.size());
        progress_.species = asked.size();
        for (const Record& r : experiment.records) {
            slowest_ = std::min(slowest_, 0.5 / (static_cast<double>(r.size()) * r.sample_time));
            fastest_ = std::max(fastest_, 3.0 / r.sample_time);
            noise_ += noise_power(r.output) * static_cast<double>(r.size());
        }
    }

    Trial run() {
        trial_.best.resize(static_cast<std::size_t>(genome_.words()));
        int quiet = 0;
        for (int done = 0; done < settings_.generations && quiet < settings_.quiet_rounds;) {
            const int generations = std::min(settings_.round, settings_.generations - done);
            breed_round(generations, done);
            const bool better = fit_round(done == 0 ? quick : thorough);
            const std::size_t leader = leading();
            progress_.lead(all_[leader], trial_.species[leader].cost);
            if (lead() <= down_to_noise * down_to_noise * noise_) ++quiet;
            else quiet = better || done == 0 ? 0 : quiet + 1;
            done += generations;
        }
        for (const auto& island : islands_) {
            trial_.evaluations += island->evaluations();
            trial_.overflows += island->overflows();
        }
        std::size_t kept = 0;
        for (std::size_t i = 0; i < all_.size(); ++i)
            if (is_asked(i)) std::swap(trial_.species[kept++], trial_.species[i]);
        trial_.species.resize(kept);
        return std::move(trial_);
    }

private:
    // An island for these structures.
    void settle(const Genome& genome, std::span<const std::size_t> which, std::size_t population, Random random) {
        std::vector<Structure> species;
        for (const std::size_t i : which) {
            places_[i] = {islands_.size(), species.size()};
            species.push_back(all_[i]);
        }
        Settings own = settings_;
        own.population = static_cast<int>(population);
        islands_.push_back(std::make_unique<Island>(experiment_, genome, own, random, species));
    }

    bool is_asked(std::size_t i) const { return all_[i].p >= genome_.ranges().p_min && all_[i].q >= genome_.ranges().q_min; }

    static RefineOptions options(const Genome& genome, std::size_t samples) {
        RefineOptions o;
        o.ranges = genome.ranges();
        o.tolerance = 0.01 / static_cast<double>(samples);  // of a unit of BIC: N ln J
        return o;
    }

    // Every round starts from fresh random individuals: the optima already fitted are kept apart, and what a round is for
    // is to find another basin.
    void breed_round(int generations, int done) {
        experiment_.share(islands_.size(), [&](std::size_t k) {
            islands_[k]->breed(generations,
                               [&](double least) { progress_.note(k == 0 ? 1 : 0, k < asked_islands_ ? least : worst_fitness); });
        });
        for (std::size_t g = 0; g < static_cast<std::size_t>(generations); ++g) {
            for (std::size_t k = 0; k < asked_islands_; ++k) {
                const Island& island = *islands_[k];
                if (!(island.history()[g] < trial_.best_fitness)) continue;
                trial_.best_fitness = island.history()[g];
                trial_.best_generation = done + static_cast<int>(g);
                trial_.best = island.best();  // of its round; a later generation that is better still comes later in this loop
            }
            trial_.history.push_back(trial_.best_fitness);
        }
    }

    // Local fits, from small structures to large; true where one that is close to the best found a better optimum.
    bool fit_round(const Effort& effort) {
        std::vector<double> before;
        for (const Refined& r : trial_.species) before.push_back(r.cost);
        Level level;
        do level = fit_level(level, effort);
        while (level.first < all_.size());
        fit_smaller();
        for (std::size_t i = 0; i < all_.size(); ++i) {
            const double now = trial_.species[i].cost;
            if (now < close_to_best * lead() && now < worth_a_round * before[i]) return true;
        }
        return false;
    }

    // Where a species' local fits may start: its best individual (from == own index), or a smaller structure's optimum, grown.
    struct Source {
        std::size_t species, from;
        std::vector<Refined> starts;
    };

    // Structures [first, last) of the same p + q, which do not need one another, and the most promising fit of each.
    struct Level {
        std::size_t first = 0, last = 0;
        std::vector<Refined> best;
        double within_reach = 0.0;
    };

    // The level after `before`, and the end of the fits of that one. All starts get a few iterations, the most promising some more, and the
    // best of each species goes on to its optimum: unless it stays so far behind what a smaller or equal structure has reached that it
    // cannot win.
    Level fit_level(Level& before, const Effort& effort) {
        Level level{before.last, before.last, {}, 0.0};
        while (level.last < all_.size() && all_[level.last].poles() == all_[level.first].poles()) ++level.last;
        std::vector<Source> early, late;  // late: from the optima of the level before
        for (std::size_t i = level.first; i < level.last; ++i)
            for (std::size_t j = 0; j < level.first; ++j)
                if (may_grow(all_[j], all_[i])) (j < before.first ? early : late).push_back({i, j, {}});
        for (std::size_t i = level.first; i < level.last; ++i) early.push_back({i, i, {}});
        // The few fits that go on to the end would leave threads idle: what does not need them is done beside them. Begun last, of what is
        // listed first, is work that shares its own parts.
        experiment_.share(early.size() + before.best.size(), [&](std::size_t k) {
            if (k < early.size()) first_fits(early[k], effort);
            else to_the_end(before, k - early.size());
        });
        for (std::size_t k = 0; k < before.best.size(); ++k) keep_better(before.first + k, before.best[k]);
        experiment_.share(late.size(), [&](std::size_t k) { first_fits(late[k], effort); });

        const auto lower = [](const Refined& x, const Refined& y) { return x.cost < y.cost; };
        std::vector<Refined> chosen;
        for (std::size_t i = level.first; i < level.last; ++i) {
            std::vector<Refined> starts;
            for (std::vector<Source>* sources : {&early, &late})
                for (Source& s : *sources)
                    if (s.species == i) std::move(s.starts.begin(), s.starts.end(), std::back_inserter(starts));
            std::stable_sort(starts.begin(), starts.end(), lower);
            starts.resize(std::min(starts.size(), effort.promising));
            std::move(starts.begin(), starts.end(), std::back_inserter(chosen));
        }
        experiment_.share(chosen.size(), [&](std::size_t k) { chosen[k] = refiner_.go_on(chosen[k], more_iterations); });

        level.within_reach = lead();
        for (const Refined& r : chosen) level.within_reach = std::min(level.within_reach, r.cost);
        level.within_reach *= out_of_reach;
        level.best.resize(level.last - level.first);
        for (const Refined& r : chosen) {
            const auto i = std::find(all_.begin(), all_.end(), r.factors.structure) - all_.begin();
            Refined& b = level.best[static_cast<std::size_t>(i) - level.first];
            if (b.cost == worst_fitness || r.cost < b.cost) b = r;
        }
        return level;
    }

    void to_the_end(Level& level, std::size_t k) const {
        Refined& fit = level.best[k];
        if (fit.cost < 1.5 * trial_.species[level.first + k].cost && fit.cost < level.within_reach)
            fit = refiner_.go_on(fit, full_iterations);
    }

    // What a larger structure has found, a smaller one may lack: each that is close to the best lends its optimum with one module taken
    // away, the largest first, so that what it gave goes on to the next smaller one.
    void fit_smaller() {
        for (std::size_t from = all_.size(); from-- > 0;) {
            if (trial_.species[from].cost > close_to_best * lead()) continue;
            std::vector<std::size_t> smaller;
            for (std::size_t i = 0; i < from; ++i)
                if (may_grow(all_[i], all_[from])) smaller.push_back(i);
            std::vector<Refined> found(smaller.size());
            experiment_.share(smaller.size(), [&](std::size_t k) {
                const std::vector<Factors<double>> made = shrink(trial_.species[from].factors, all_[smaller[k]]);
                if (made.empty()) return;
                const std::vector<double> costs = refiner_.costs(made);
                const auto at = std::min_element(costs.begin(), costs.end()) - costs.begin();
                if (costs[static_cast<std::size_t>(at)] < trial_.species[smaller[k]].cost)
                    found[k] = refiner_.fit(made[static_cast<std::size_t>(at)], {}, full_iterations);
            });
            for (std::size_t k = 0; k < smaller.size(); ++k)
                if (found[k].cost < trial_.species[smaller[k]].cost) keep_better(smaller[k], found[k]);
        }
    }

    void keep_better(std::size_t i, Refined& found) {
        Refined& own = trial_.species[i];
        if (!(found.cost < own.cost) && own.cost < worst_fitness) return;
        own = std::move(found);
    }

    // The least error sum of all structures asked for.
    double lead() const { return trial_.species[leading()].cost; }

    // Whose it is: the first of them.
    std::size_t leading() const {
        std::size_t found = all_.size();
        for (std::size_t i = 0; i < all_.size(); ++i)
            if (is_asked(i) && (found == all_.size() || trial_.species[i].cost < trial_.species[found].cost)) found = i;
        return found;
    }

    void first_fits(Source& s, const Effort& effort) const {
        if (s.from == s.species) {
            const Place at = places_[s.species];
            s.starts.push_back(refiner_.fit(islands_[at.island]->candidate(at.species), {}, effort.first));
            return;
        }
        const std::vector<Factors<double>> grown =
            grow(trial_.species[s.from].factors, all_[s.species], genome_.ranges(), slowest_, fastest_);
        const std::vector<std::size_t> lowest = lowest_apart(grown, refiner_.costs(grown), effort.grown);
        s.starts.resize(lowest.size());
        experiment_.share(lowest.size(), [&](std::size_t k) { s.starts[k] = refiner_.fit(grown[lowest[k]], {}, effort.first); });
    }

    // The best grown candidates, no two of them from the same place on the grid (grow() lists one place after the other).
    static std::vector<std::size_t> lowest_apart(const std::vector<Factors<double>>& grown, const std::vector<double>& costs,
                                                 std::size_t count) {
        const std::size_t place = std::max<std::size_t>(1, grown.size() / grid_points);
        std::vector<std::size_t> order(grown.size()), chosen;
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::sort(order.begin(), order.end(),
                  [&](std::size_t x, std::size_t y) { return costs[x] < costs[y] || (costs[x] == costs[y] && x < y); });
        for (const std::size_t at : order) {
            const bool apart = std::none_of(chosen.begin(), chosen.end(), [&](std::size_t c) { return c / place == at / place; });
            if (apart) chosen.push_back(at);
            if (chosen.size() == count) break;
        }
        return chosen;
    }

    struct Place {
        std::size_t island, species;
    };

    const Experiment& experiment_;
    Genome genome_;
    Settings settings_;
    Progress& progress_;
    std::vector<Structure> all_;
    Refiner refiner_;
    std::vector<std::unique_ptr<Island>> islands_;
    std::size_t asked_islands_ = 0;  // the first so many; the last may hold smaller structures
    std::vector<Place> places_;      // of each structure
    Trial trial_;
    double slowest_ = 1e300, fastest_ = 0.0;  // rad/s, where a module can still be seen
    double noise_ = 0.0;                      // error sum that the noise of the measured velocity alone makes
};

}  // namespace

Trial run_species(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random,
                  Progress& progress) {
    return SpeciesRun(experiment, genome, settings, random, progress).run();
}

}  // namespace gaident
