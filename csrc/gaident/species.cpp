#include "species.hpp"

#include "parallel.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace gaident {

std::vector<Structure> structures(const SearchRanges& r) {
    std::vector<Structure> all;
    for (int n = r.p_min + r.q_min; n <= r.p_max + r.q_max; ++n)
        for (int q = std::max(r.q_min, n - r.p_max); q <= std::min(r.q_max, n - r.p_min); ++q) all.push_back({n - q, q});
    return all;
}

namespace {

struct Roots {
    std::complex<double> poles[max_plant_order], zeros[max_plant_order];
    std::size_t n = 0, q = 0;

    explicit Roots(const Factors<double>& g)
        : n(static_cast<std::size_t>(g.structure.poles())), q(static_cast<std::size_t>(g.structure.q)) {
        roots_of(g, poles, zeros);
    }
    void pole(std::complex<double> s) { poles[n++] = s; }
    void zero(std::complex<double> s) { zeros[q++] = s; }
    Factors<double> factors(double gain) const { return factors_from_roots(gain, {poles, n}, {zeros, q}); }
};

}  // namespace

constexpr int grid_points = 12;

std::vector<Factors<double>> grow(const Factors<double>& from, Structure to, const SearchRanges& ranges, double slowest,
                                  double fastest) {
    const int dp = to.p - from.structure.p, dq = to.q - from.structure.q;
    std::vector<Factors<double>> made;
    constexpr int points = grid_points;
    const auto grid = [&](double lo, double hi, auto&& use) {
        lo = std::max(lo, slowest);
        hi = std::min(hi, fastest);
        if (!(hi > lo)) return;
        for (int k = 0; k < points; ++k) use(lo * std::pow(hi / lo, (k + 0.5) / points));
    };
    const auto resonance = [&](double w, double ratio, double damping, double gain) {
        Roots r(from);
        const auto pair = [&](double f, auto&& put) {
            const std::complex<double> s{-damping * f, f};
            put(s);
            put(std::conj(s));
        };
        pair(w, [&](std::complex<double> s) { r.zero(s); });
        pair(w * ratio, [&](std::complex<double> s) { r.pole(s); });
        made.push_back(r.factors(from.gain * gain));
    };
    if (dp == 0 && dq == 2) {
        grid(ranges.imaginary.lo, ranges.imaginary.hi, [&](double w) {
            for (const double ratio : {0.8, 1.1, 1.6})
                for (const double damping : {0.03, 0.2}) {
                    resonance(w, ratio, damping, 1.0);
                    resonance(w, ratio, damping, ratio * ratio);
                }
        });
    } else if (dp == 0 && dq == 1) {
        grid(ranges.real.lo, ranges.real.hi, [&](double a) {
            for (const double ratio : {0.5, 0.9, 1.1, 2.0})
                for (const double gain : {1.0, ratio}) {
                    Roots r(from);
                    r.zero(-a);
                    r.pole(-a * ratio);
                    made.push_back(r.factors(from.gain * gain));
                }
        });
    } else if (dp == 1 && dq == 0) {
        grid(ranges.real.lo, ranges.real.hi, [&](double a) {
            Roots r(from);
            r.pole(-a);
            made.push_back(r.factors(from.gain * a));
        });
    } else if (dp == 2 && dq == 0) {
        grid(ranges.imaginary.lo, ranges.imaginary.hi, [&](double w) {
            for (const double damping : {0.1, 0.6}) {
                Roots r(from);
                const std::complex<double> s{-damping * w, w};
                r.pole(s);
                r.pole(std::conj(s));
                made.push_back(r.factors(from.gain * w * w * (1.0 + damping * damping)));
            }
        });
    }
    return made;
}

namespace {

constexpr int quick_iterations = 6, full_iterations = 40;
constexpr std::size_t grown_starts = 2;

class SpeciesRun {
public:
    SpeciesRun(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, int workers,
               Progress& progress)
        : experiment_(experiment), genome_(genome), settings_(with_room(settings, genome)), workers_(workers), progress_(progress),
          all_(structures(genome.ranges())), refiner_(experiment, options(genome)),
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
        }
    }

    Trial run() {
        trial_.best.resize(static_cast<std::size_t>(genome_.words()));
        int quiet = 0;
        for (int done = 0; done < settings_.generations && quiet < settings_.quiet_rounds;) {
            const int generations = std::min(settings_.round, settings_.generations - done);
            breed_round(generations, done);
            quiet = fit_round() ? 0 : quiet + 1;
            if (done == 0) quiet = 0;
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
    static RefineOptions options(const Genome& genome) {
        RefineOptions o;
        o.ranges = genome.ranges();
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

    bool fit_round() {
        std::vector<char>& better = better_;
        better.assign(all_.size(), 0);
        for (std::size_t first = 0; first < all_.size();) {
            std::size_t last = first;  // one level: structures with the same p + q do not need one another
            while (last < all_.size() && all_[last].poles() == all_[first].poles()) ++last;
            parallel(last - first, workers_, [&](std::size_t k) { better[first + k] = fit_species(first + k) ? 1 : 0; });
            first = last;
        }
        return std::any_of(better.begin(), better.end(), [](char c) { return c != 0; });
    }

    bool fit_species(std::size_t i) {
        Refined& own = trial_.species[i];
        const double before = own.cost;
        std::vector<Refined> starts;
        const std::size_t best = breeder_.best_of(groups_[i].first, groups_[i].count);
        starts.push_back(refiner_.fit(breeder_.candidate(best), {}, quick_iterations));
        for (std::size_t j = 0; j < i; ++j) {
            if (before < worst_fitness && better_[j] == 0) continue;  // nothing new to lend since the last round
            std::vector<Factors<double>> grown = grow(trial_.species[j].factors, all_[i], genome_.ranges(), slowest_, fastest_);
            if (grown.empty()) continue;
            const std::vector<double> costs = refiner_.costs(grown);
            for (const std::size_t at : lowest_apart(grown, costs)) starts.push_back(refiner_.fit(grown[at], {}, quick_iterations));
        }
        const auto lower = [](const Refined& x, const Refined& y) { return x.cost < y.cost; };
        const Refined& start = *std::min_element(starts.begin(), starts.end(), lower);
        if (!(start.cost < before * 1.5)) return false;
        Refined fitted = refiner_.fit(start.factors, start.starts, full_iterations);
        if (!(fitted.cost < before)) return false;
        own = std::move(fitted);
        return own.cost < before * 0.999;
    }

    // The best grown candidates, no two of them from the same place on the grid (grow() lists one place after the other).
    static std::vector<std::size_t> lowest_apart(const std::vector<Factors<double>>& grown, const std::vector<double>& costs) {
        const std::size_t place = std::max<std::size_t>(1, grown.size() / grid_points);
        std::vector<std::size_t> order(grown.size()), chosen;
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) { return costs[x] < costs[y] || (costs[x] == costs[y] && x < y); });
        for (const std::size_t at : order) {
            const bool apart = std::none_of(chosen.begin(), chosen.end(), [&](std::size_t c) { return c / place == at / place; });
            if (apart) chosen.push_back(at);
            if (chosen.size() == grown_starts) break;
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
};

}  // namespace

Trial run_species(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, int workers,
                  Progress& progress) {
    return SpeciesRun(experiment, genome, settings, random, workers, progress).run();
}

}  // namespace gaident
