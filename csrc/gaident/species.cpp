#include "species.hpp"

#include "neighbours.hpp"
#include "parallel.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
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
// A structure whose error sum is so many times another one's of no larger size is not fitted to the end.
constexpr double out_of_reach = 2.0;

// Power of white noise on a smooth signal, from its third differences (median, so robust), whose variance is 1 + 9 + 9 + 1 = 20 times
// the noise's. Of a long record an evenly spaced part will do.
double noise_power(std::span<const double> w) {
    constexpr std::size_t enough = 4096;
    const std::size_t stride = std::max<std::size_t>(1, w.size() / enough);
    std::vector<double> sizes;
    for (std::size_t n = 3; n < w.size(); n += stride) sizes.push_back(std::abs(w[n] - 3.0 * w[n - 1] + 3.0 * w[n - 2] - w[n - 3]));
    if (sizes.empty()) return 0.0;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return 1.4826 * 1.4826 * *middle * *middle / 20.0;
}

class SpeciesRun {
public:
    SpeciesRun(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, int workers,
               Progress& progress)
        : experiment_(experiment), genome_(genome), settings_(with_room(settings, genome)), workers_(workers), progress_(progress),
          all_(structures(genome.ranges())), refiner_(experiment, options(genome, experiment.samples())),
          breeder_(experiment, genome_, settings_, random) {
        const std::size_t n = static_cast<std::size_t>(settings_.population), share = n / all_.size(), extra = n % all_.size();
        std::size_t first = 0;
        for (std::size_t i = 0; i < all_.size(); ++i) {
            const std::size_t count = share + (i < extra ? 1 : 0);
            groups_.push_back({first, static_cast<std::uint32_t>(count), 1, true});
            first += count;
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
        trial_.evaluations = breeder_.evaluations();
        return std::move(trial_);
    }

private:
    static Settings with_room(Settings s, const Genome& genome) {
        const auto needed = 3 * structures(genome.ranges()).size();  // fewer than three cannot mate
        s.population = std::max(s.population, static_cast<int>(needed));
        return s;
    }
    static RefineOptions options(const Genome& genome, std::size_t samples) {
        RefineOptions o;
        o.ranges = genome.ranges();
        o.tolerance = 0.01 / static_cast<double>(samples);  // of a unit of BIC: N ln J
        return o;
    }

    // Every round starts from fresh random individuals: the optima already fitted are kept apart, and what a round is for
    // is to find another basin.
    void breed_round(int generations, int done) {
        breeder_.randomise(0, static_cast<std::size_t>(settings_.population));
        for (std::size_t i = 0; i < all_.size(); ++i) breeder_.set_structure(groups_[i].first, groups_[i].count, all_[i]);
        breeder_.evaluate();
        for (int g = 0;; ++g) {
            const std::size_t best = breeder_.best_of(0, static_cast<std::size_t>(settings_.population));
            trial_.history.push_back(std::min(breeder_.cost(best), trial_.best_fitness));
            if (breeder_.cost(best) < trial_.best_fitness) {
                trial_.best_fitness = breeder_.cost(best);
                trial_.best_generation = done + g;
                std::copy(breeder_[best], breeder_[best] + genome_.words(), trial_.best.begin());
            }
            progress_.note(1, trial_.best_fitness);
            if (g + 1 == generations) break;
            breeder_.generation(groups_);
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
            Refined& b = best[static_cast<std::size_t>(std::find(all_.begin(), all_.end(), r.factors.structure) - all_.begin()) - first];
            if (b.cost == worst_fitness || r.cost < b.cost) b = r;
        }
        parallel(best.size(), workers_, [&](std::size_t k) {
            const double before = trial_.species[first + k].cost;
            if (best[k].cost < 1.5 * before && best[k].cost < within_reach) best[k] = refiner_.go_on(best[k], full_iterations);
        });
        for (std::size_t i = first; i < last; ++i) keep_better(i, best[i - first]);
    }

    // What a larger structure has found, a smaller one may lack: the leader lends its optimum with one module taken away.
    void fit_smaller() {
        for (;;) {
            const auto lower = [](const Refined& x, const Refined& y) { return x.cost < y.cost; };
            const auto leader = static_cast<std::size_t>(
                std::min_element(trial_.species.begin(), trial_.species.end(), lower) - trial_.species.begin());
            std::vector<std::size_t> smaller;
            for (std::size_t i = 0; i < leader; ++i)
                if (may_grow(all_[i], all_[leader])) smaller.push_back(i);
            std::vector<Refined> found(smaller.size());
            parallel(smaller.size(), workers_, [&](std::size_t k) {
                const std::vector<Factors<double>> made = shrink(trial_.species[leader].factors, all_[smaller[k]]);
                if (made.empty()) return;
                const std::vector<double> costs = refiner_.costs(made);
                const auto at = static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
                found[k] = refiner_.fit(made[at], {}, quick.first + more_iterations);
                if (found[k].cost < out_of_reach * trial_.species[leader].cost)
                    found[k] = refiner_.go_on(found[k], full_iterations);
            });
            bool taken = false;
            for (std::size_t k = 0; k < smaller.size(); ++k)
                if (found[k].cost < worst_fitness) taken = keep_better(smaller[k], found[k]) || taken;
            // A smaller structure that has become the leader lends in its turn.
            if (!taken || lead() >= trial_.species[leader].cost) return;
        }
    }

    bool keep_better(std::size_t i, Refined& found) {
        Refined& own = trial_.species[i];
        if (!(found.cost < own.cost) && own.cost < worst_fitness) return false;
        const bool clearly = found.cost < 0.999 * own.cost;
        if (clearly) better_[i] = 1;
        own = std::move(found);
        return clearly;
    }

    // The least error sum of all structures.
    double lead() const {
        double least = worst_fitness;
        for (const Refined& r : trial_.species) least = std::min(least, r.cost);
        return least;
    }

    void first_fits(Source& s, const Effort& effort) const {
        if (s.from == s.species) {
            const std::size_t best = breeder_.best_of(groups_[s.species].first, groups_[s.species].count);
            s.starts.push_back(refiner_.fit(breeder_.candidate(best), {}, effort.first));
            return;
        }
        const std::vector<Factors<double>> grown =
            grow(trial_.species[s.from].factors, all_[s.species], genome_.ranges(), slowest_, fastest_);
        const std::vector<double> costs = refiner_.costs(grown);
        for (const std::size_t at : lowest_apart(grown, costs, effort.grown)) s.starts.push_back(refiner_.fit(grown[at], {}, effort.first));
    }

    // The best grown candidates, no two of them from the same place on the grid (grow() lists one place after the other).
    static std::vector<std::size_t> lowest_apart(const std::vector<Factors<double>>& grown, const std::vector<double>& costs,
                                                 std::size_t count) {
        const std::size_t place = std::max<std::size_t>(1, grown.size() / grid_points);
        std::vector<std::size_t> order(grown.size()), chosen;
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) { return costs[x] < costs[y] || (costs[x] == costs[y] && x < y); });
        for (const std::size_t at : order) {
            const bool apart = std::none_of(chosen.begin(), chosen.end(), [&](std::size_t c) { return c / place == at / place; });
            if (apart) chosen.push_back(at);
            if (chosen.size() == count) break;
        }
        return chosen;
    }

    const Experiment& experiment_;
    Genome genome_;
    Settings settings_;
    int workers_;
    Progress& progress_;
    std::vector<Structure> all_;
    Refiner refiner_;
    Breeder breeder_;
    std::vector<Breeder::Group> groups_;
    Trial trial_;
    std::vector<char> better_;  // per species: improved in the round under way
    double slowest_ = 1e300, fastest_ = 0.0;  // rad/s, where a module can still be seen
    double noise_ = 0.0;                      // error sum that the noise of the measured velocity alone makes
};

}  // namespace

Trial run_species(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, int workers,
                  Progress& progress) {
    return SpeciesRun(experiment, genome, settings, random, workers, progress).run();
}

}  // namespace gaident
