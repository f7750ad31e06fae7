// The default engine: one population per species, so that no species is lost before its parameters are tuned
// (docs/identification.md).
//
// In rounds: some generations of the genetic search inside each species, then a local search from each species' best.
// From small species to large, an optimum is also a start for the larger ones, and the leader's in the end for the smaller ones.
// A first round is quick.
// Where it leaves more than the least cost expected, rounds with many more starts follow until one finds no better optimum close
// to the best.
// Species that are not asked for are searched as well where they lead to those that are: from random starts alone the optimum of
// a large species is rarely found, from the optimum of a smaller one nearly always.
// Species are not compared here.
#pragma once

#include "engine.hpp"
#include "island.hpp"

#include <algorithm>
#include <iterator>

namespace gaident {

template <class Fit>
class SpeciesSearch {
public:
    SpeciesSearch(const SpeciesObjective<Fit>& objective, const Settings& settings, Random random, const Resources& resources)
        : objective_(objective), settings_(settings), resources_(resources), all_(objective.species()) {
        places_.resize(all_.size());
        std::vector<std::size_t> asked, smaller;
        for (std::size_t i = 0; i < all_.size(); ++i) (all_[i].asked ? asked : smaller).push_back(i);
        // The number of islands depends on the objective alone, never on the workers: the same seed has to give the same result.
        const std::size_t islands = objective.is_long() ? std::min(most_islands, asked.size()) : 1;
        const std::size_t population = std::max(static_cast<std::size_t>(settings_.population), least_in_species * asked.size());
        for (std::size_t k = 0; k < islands; ++k) {
            const std::size_t first = k * asked.size() / islands, last = (k + 1) * asked.size() / islands;
            settle(std::span(asked).subspan(first, last - first), (k + 1) * population / islands - k * population / islands,
                   islands == 1 ? random : Random(random.word()));
        }
        asked_islands_ = islands_.size();
        if (!smaller.empty()) settle(smaller, least_in_species * smaller.size(), Random(random.word()));
        trial_.species.resize(all_.size());
        resources_.progress.species = asked.size();
    }

    SpeciesTrial<Fit> trial() {
        trial_.best.resize(static_cast<std::size_t>(objective_.layout().words()));
        int quiet = 0;
        for (int done = 0; done < settings_.generations && quiet < settings_.quiet_rounds;) {
            const int generations = std::min(settings_.round, settings_.generations - done);
            breed_round(generations, done);
            const bool better = fit_round(done == 0 ? quick : thorough);
            const std::size_t leader = leading();
            resources_.progress.lead(leader, trial_.species[leader].cost);
            if (lead() <= near_expected * objective_.least_expected()) ++quiet;
            else quiet = better || done == 0 ? 0 : quiet + 1;
            done += generations;
        }
        for (const auto& island : islands_) {
            trial_.evaluations += island->evaluations();
            trial_.overflows += island->overflows();
        }
        std::size_t kept = 0;
        for (std::size_t i = 0; i < all_.size(); ++i)
            if (all_[i].asked) std::swap(trial_.species[kept++], trial_.species[i]);
        trial_.species.resize(kept);
        return std::move(trial_);
    }

private:
    // How hard a species' optimum is looked for.
    struct Effort {
        std::size_t enlarged;   // starts from each smaller species
        int first;              // iterations that every start gets
        std::size_t promising;  // starts that get more
    };
    static constexpr Effort quick{2, 2, 3}, thorough{5, 6, 10};
    static constexpr int more_iterations = 4, full_iterations = 40;
    // Where the least cost is more than so many times what is expected, there may be a better optimum: 1.2 times the root mean
    // square.
    static constexpr double near_expected = 1.2 * 1.2;
    // How many islands the search has where one evaluation takes long.
    static constexpr std::size_t most_islands = 4;
    // Individuals that a species has at least: fewer cannot mate.
    static constexpr std::size_t least_in_species = 3;
    // A species whose cost is so many times another one's of no larger size is not fitted to the end.
    static constexpr double out_of_reach = 2.0;
    // A new optimum of a species that costs less than so many times its best one is fitted to the end.
    static constexpr double near_its_best = 1.5;
    // A species whose cost is within so many times the least is about as good as any.
    static constexpr double close_to_best = 1.2;
    // Largest share of the cost that a better optimum leaves: a smaller fall ends the local search, without another round.
    static constexpr double worth_a_round = 0.95;

    // An island for these species.
    void settle(std::span<const std::size_t> which, std::size_t population, Random random) {
        for (std::size_t k = 0; k < which.size(); ++k) places_[which[k]] = {islands_.size(), k};
        Settings own = settings_;
        own.population = static_cast<int>(population);
        const auto set_species = [this](Word* c, std::size_t s) { objective_.set_species(c, s); };
        islands_.push_back(std::make_unique<Island>(objective_, set_species, own, random, resources_, which));
    }

    // Calls work(0) ... work(n-1), which evaluate each; the last is begun first.
    template <class Work>
    void share(std::size_t n, const Work& work) const {
        const auto unless_stopped = [&](std::size_t i) {
            stop_if_asked(resources_.stop);
            work(i);
        };
        if (objective_.is_long()) return resources_.workers.share(n, unless_stopped);
        while (n > 0) unless_stopped(--n);
    }

    // Every round starts from fresh random individuals: the optima already fitted are kept apart, and what a round is for
    // is to find another basin.
    void breed_round(int generations, int done) {
        share(islands_.size(), [&](std::size_t k) {
            islands_[k]->breed(generations, [&](double least) {
                resources_.progress.note(k == 0 ? 1 : 0, k < asked_islands_ ? least : worst_cost);
            });
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

    // Local searches, from small species to large; true where one that is close to the best found a better optimum.
    bool fit_round(const Effort& effort) {
        std::vector<double> before;
        for (const Fit& f : trial_.species) before.push_back(f.cost);
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

    // Where the local searches of a species may start: its best individual (from == own index), or a smaller one's optimum,
    // enlarged.
    struct Source {
        std::size_t species, from;
        std::vector<Fit> starts;
    };

    // Species [first, last) of one level, which do not need one another, and the most promising fit of each.
    struct Level {
        std::size_t first = 0, last = 0;
        std::vector<Fit> best;
        double within_reach = 0.0;
    };

    // The level after `before`, and the end of the fits of that one.
    // All starts get a few iterations, the most promising some more, and the best of each species goes on to its optimum: unless
    // it stays so far behind what a smaller or equal structure has reached that it cannot win.
    Level fit_level(Level& before, const Effort& effort) {
        Level level{before.last, before.last, {}, 0.0};
        while (level.last < all_.size() && all_[level.last].level == all_[level.first].level) ++level.last;
        std::vector<Source> early, late;  // late: from the optima of the level before
        for (std::size_t i = level.first; i < level.last; ++i)
            for (std::size_t j = 0; j < level.first; ++j)
                if (objective_.leads_to(j, i)) (j < before.first ? early : late).push_back({i, j, {}});
        for (std::size_t i = level.first; i < level.last; ++i) early.push_back({i, i, {}});
        // The few fits that go on to the end would leave threads idle: what does not need them is done beside them.
        // Begun last, of what is listed first, is work that shares its own parts.
        share(early.size() + before.best.size(), [&](std::size_t k) {
            if (k < early.size()) first_fits(early[k], effort);
            else to_the_end(before, k - early.size());
        });
        for (std::size_t k = 0; k < before.best.size(); ++k) keep_better(before.first + k, before.best[k]);
        share(late.size(), [&](std::size_t k) { first_fits(late[k], effort); });

        struct Chosen {
            std::size_t species;
            Fit fit;
        };
        std::vector<Chosen> chosen;
        for (std::size_t i = level.first; i < level.last; ++i) {
            std::vector<Fit> starts;
            for (std::vector<Source>* sources : {&early, &late})
                for (Source& s : *sources)
                    if (s.species == i) std::move(s.starts.begin(), s.starts.end(), std::back_inserter(starts));
            std::stable_sort(starts.begin(), starts.end(), [](const Fit& x, const Fit& y) { return x.cost < y.cost; });
            starts.resize(std::min(starts.size(), effort.promising));
            for (Fit& f : starts) chosen.push_back({i, std::move(f)});
        }
        share(chosen.size(), [&](std::size_t k) { chosen[k].fit = objective_.improved(chosen[k].fit, more_iterations); });

        level.within_reach = lead();
        for (const Chosen& c : chosen) level.within_reach = std::min(level.within_reach, c.fit.cost);
        level.within_reach *= out_of_reach;
        level.best.resize(level.last - level.first);
        for (Chosen& c : chosen) {
            Fit& b = level.best[c.species - level.first];
            if (b.cost == worst_cost || c.fit.cost < b.cost) b = std::move(c.fit);
        }
        return level;
    }

    void to_the_end(Level& level, std::size_t k) const {
        Fit& fit = level.best[k];
        if (fit.cost < near_its_best * trial_.species[level.first + k].cost && fit.cost < level.within_reach)
            fit = objective_.improved(fit, full_iterations);
    }

    // What a larger species has found, a smaller one may lack: the optimum of each that is close to the best, reduced, is a start
    // there; the largest first, so that its optimum reaches the smallest step by step.
    void fit_smaller() {
        for (std::size_t from = all_.size(); from-- > 0;) {
            if (trial_.species[from].cost > close_to_best * lead()) continue;
            std::vector<std::size_t> smaller;
            for (std::size_t i = 0; i < from; ++i)
                if (objective_.leads_to(i, from)) smaller.push_back(i);
            std::vector<Fit> found(smaller.size());
            share(smaller.size(), [&](std::size_t k) {
                const Fit start = objective_.reduced(trial_.species[from], smaller[k]);
                if (start.cost < trial_.species[smaller[k]].cost) found[k] = objective_.improved(start, full_iterations);
            });
            for (std::size_t k = 0; k < smaller.size(); ++k)
                if (found[k].cost < trial_.species[smaller[k]].cost) keep_better(smaller[k], found[k]);
        }
    }

    void keep_better(std::size_t i, Fit& found) {
        Fit& own = trial_.species[i];
        if (!(found.cost < own.cost) && own.cost < worst_cost) return;
        own = std::move(found);
    }

    // The least cost of all species asked for.
    double lead() const { return trial_.species[leading()].cost; }

    // Whose it is: the first of them.
    std::size_t leading() const {
        std::size_t found = all_.size();
        for (std::size_t i = 0; i < all_.size(); ++i)
            if (all_[i].asked && (found == all_.size() || trial_.species[i].cost < trial_.species[found].cost)) found = i;
        return found;
    }

    void first_fits(Source& s, const Effort& effort) const {
        if (s.from == s.species) {
            const Place at = places_[s.species];
            s.starts.push_back(objective_.improved(objective_.start(islands_[at.island]->best_of(at.place)), effort.first));
            return;
        }
        s.starts = objective_.enlarged(trial_.species[s.from], s.species, effort.enlarged);
        share(s.starts.size(), [&](std::size_t k) { s.starts[k] = objective_.improved(s.starts[k], effort.first); });
    }

    struct Place {
        std::size_t island, place;
    };

    const SpeciesObjective<Fit>& objective_;
    Settings settings_;
    Resources resources_;
    std::span<const Species> all_;
    std::vector<std::unique_ptr<Island>> islands_;
    std::size_t asked_islands_ = 0;  // the first so many; the last may contain species that are not asked for
    std::vector<Place> places_;      // of each species
    SpeciesTrial<Fit> trial_;
};

// `trials` of them. The result depends on the seed alone. Throws as search() does.
template <class Fit>
std::vector<SpeciesTrial<Fit>> search_species(const SpeciesObjective<Fit>& objective, const Settings& settings, int trials,
                                              std::uint64_t seed, const Resources& resources) {
    return independent_trials<SpeciesTrial<Fit>>(settings, trials, seed, resources.workers, [&](Random random) {
        return SpeciesSearch<Fit>(objective, settings, random, resources).trial();
    });
}

}  // namespace gaident
