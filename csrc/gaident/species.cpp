#include "species.hpp"

#include "island.hpp"
#include "neighbours.hpp"
#include "parallel.hpp"

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
// Samples from which a search is worth threads, and how many islands it then has.
constexpr std::size_t long_enough = 4096, most_islands = 4;
// A structure whose error sum is so many times another one's of no larger size is not fitted to the end.
constexpr double out_of_reach = 2.0;
// A structure whose error sum is within so many times the least describes the data about as well as any.
constexpr double close_to_best = 1.2;

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

class SpeciesRun {
public:
    SpeciesRun(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, int workers,
               Progress& progress)
        : genome_(genome),
          settings_(settings),
          workers_(worth_threads(experiment) ? workers : 1),
          progress_(progress),
          all_(structures(genome.ranges())),
          refiner_(experiment, options(genome, experiment.samples())) {
        // The number of islands depends on the data alone, never on the workers: the same seed has to give the same result.
        const std::size_t islands = worth_threads(experiment) ? std::min(most_islands, all_.size()) : 1;
        settings_.population = std::max(settings_.population, static_cast<int>(3 * all_.size()));
        for (std::size_t k = 0; k < islands; ++k) {
            const std::size_t first = k * all_.size() / islands, last = (k + 1) * all_.size() / islands;
            for (std::size_t i = first; i < last; ++i) places_.push_back({k, i - first});
            Settings own = settings_;
            own.population = static_cast<int>((k + 1) * static_cast<std::size_t>(settings_.population) / islands -
                                              k * static_cast<std::size_t>(settings_.population) / islands);
            islands_.push_back(std::make_unique<Island>(experiment, genome_, own, islands == 1 ? random : Random(random.word()),
                                                        std::span(all_).subspan(first, last - first)));
        }
        trial_.species.resize(all_.size());
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
            if (lead() <= down_to_noise * down_to_noise * noise_) ++quiet;
            else quiet = better || done == 0 ? 0 : quiet + 1;
            done += generations;
        }
        for (const auto& island : islands_) trial_.evaluations += island->evaluations();
        return std::move(trial_);
    }

private:
    static bool worth_threads(const Experiment& experiment) { return experiment.samples() >= long_enough; }
    static RefineOptions options(const Genome& genome, std::size_t samples) {
        RefineOptions o;
        o.ranges = genome.ranges();
        o.tolerance = 0.01 / static_cast<double>(samples);  // of a unit of BIC: N ln J
        return o;
    }

    // Every round starts from fresh random individuals: the optima already fitted are kept apart, and what a round is for
    // is to find another basin.
    void breed_round(int generations, int done) {
        parallel(islands_.size(), workers_, [&](std::size_t k) {
            islands_[k]->breed(generations, [&](double least) { progress_.note(k == 0 ? 1 : 0, least); });
        });
        for (std::size_t g = 0; g < static_cast<std::size_t>(generations); ++g) {
            for (const auto& island : islands_) {
                if (!(island->history()[g] < trial_.best_fitness)) continue;
                trial_.best_fitness = island->history()[g];
                trial_.best_generation = done + static_cast<int>(g);
                trial_.best = island->best();  // of its round; a later generation that is better still comes later in this loop
            }
            trial_.history.push_back(trial_.best_fitness);
        }
    }

    // Local fits, from small structures to large; true where one got better.
    bool fit_round(const Effort& effort) {
        better_.assign(all_.size(), 0);
        for (std::size_t first = 0; first < all_.size();) {
            std::size_t last = first;  // one level: structures with the same p + q do not need one another
            while (last < all_.size() && all_[last].poles() == all_[first].poles()) ++last;
            fit_level(first, last, effort);
            first = last;
        }
        fit_smaller();
        return std::any_of(better_.begin(), better_.end(), [](char c) { return c != 0; });
    }

    // Where a species' local fits may start: its best individual (from == own index), or a smaller structure's optimum, grown.
    struct Source {
        std::size_t species, from;
        std::vector<Refined> starts;
    };

    // The species of one level. All starts get a few iterations, the most promising some more, and the best of each species goes on
    // to its optimum: unless it stays so far behind what a smaller or equal structure has reached that it cannot win.
    void fit_level(std::size_t first, std::size_t last, const Effort& effort) {
        std::vector<Source> sources;
        for (std::size_t i = first; i < last; ++i) {
            sources.push_back({i, i, {}});
            for (std::size_t j = 0; j < first; ++j) {
                if (may_grow(all_[j], all_[i])) sources.push_back({i, j, {}});
            }
        }
        parallel(sources.size(), workers_, [&](std::size_t k) { first_fits(sources[k], effort); });

        const auto lower = [](const Refined& x, const Refined& y) { return x.cost < y.cost; };
        std::vector<Refined> chosen;
        for (std::size_t i = first; i < last; ++i) {
            std::vector<Refined> starts;
            for (Source& s : sources)
                if (s.species == i) std::move(s.starts.begin(), s.starts.end(), std::back_inserter(starts));
            std::stable_sort(starts.begin(), starts.end(), lower);
            starts.resize(std::min(starts.size(), effort.promising));
            std::move(starts.begin(), starts.end(), std::back_inserter(chosen));
        }
        parallel(chosen.size(), workers_, [&](std::size_t k) { chosen[k] = refiner_.go_on(chosen[k], more_iterations); });

        double within_reach = lead();
        for (const Refined& r : chosen) within_reach = std::min(within_reach, r.cost);
        within_reach *= out_of_reach;
        std::vector<Refined> best(last - first);
        for (const Refined& r : chosen) {
            Refined& b =
                best[static_cast<std::size_t>(std::find(all_.begin(), all_.end(), r.factors.structure) - all_.begin()) - first];
            if (b.cost == worst_fitness || r.cost < b.cost) b = r;
        }
        parallel(best.size(), workers_, [&](std::size_t k) {
            const double before = trial_.species[first + k].cost;
            if (best[k].cost < 1.5 * before && best[k].cost < within_reach) best[k] = refiner_.go_on(best[k], full_iterations);
        });
        for (std::size_t i = first; i < last; ++i) keep_better(i, best[i - first]);
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
            parallel(smaller.size(), workers_, [&](std::size_t k) {
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
        if (found.cost < 0.999 * own.cost) better_[i] = 1;
        own = std::move(found);
    }

    // The least error sum of all structures.
    double lead() const {
        double least = worst_fitness;
        for (const Refined& r : trial_.species) least = std::min(least, r.cost);
        return least;
    }

    void first_fits(Source& s, const Effort& effort) const {
        if (s.from == s.species) {
            const Place at = places_[s.species];
            s.starts.push_back(refiner_.fit(islands_[at.island]->candidate(at.species), {}, effort.first));
            return;
        }
        const std::vector<Factors<double>> grown =
            grow(trial_.species[s.from].factors, all_[s.species], genome_.ranges(), slowest_, fastest_);
        const std::vector<double> costs = refiner_.costs(grown);
        for (const std::size_t at : lowest_apart(grown, costs, effort.grown))
            s.starts.push_back(refiner_.fit(grown[at], {}, effort.first));
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

    Genome genome_;
    Settings settings_;
    int workers_;
    Progress& progress_;
    std::vector<Structure> all_;
    Refiner refiner_;
    std::vector<std::unique_ptr<Island>> islands_;
    std::vector<Place> places_;  // of each structure
    Trial trial_;
    std::vector<char> better_;                // per species: improved in the round under way
    double slowest_ = 1e300, fastest_ = 0.0;  // rad/s, where a module can still be seen
    double noise_ = 0.0;                      // error sum that the noise of the measured velocity alone makes
};

}  // namespace

Trial run_species(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, int workers,
                  Progress& progress) {
    return SpeciesRun(experiment, genome, settings, random, workers, progress).run();
}

}  // namespace gaident
