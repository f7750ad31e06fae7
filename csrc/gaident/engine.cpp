#include "engine.hpp"

#include "decode.hpp"
#include "denormals.hpp"
#include "species.hpp"

#include <algorithm>
#include <exception>
#include <mutex>
#include <numeric>
#include <thread>

namespace gaident {

Breeder::Breeder(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random)
    : genome_(genome), settings_(settings), random_(random), mutation_(settings.mutation, random_),
      batch_(experiment, static_cast<std::size_t>(settings.population), settings.in_float),
      now_(static_cast<std::size_t>(settings.population), genome.words()), next_(now_),
      candidates_(now_.size()), costs_(now_.size(), worst_fitness), ranking_(now_.size()),
      spare_(static_cast<std::size_t>(genome.words())) {}

void Breeder::randomise(std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i)
        random_.words(now_[i], static_cast<std::size_t>(now_.words()));
}

void Breeder::set_structure(std::size_t first, std::size_t count, Structure s) {
    for (std::size_t i = first; i < first + count; ++i) genome_.set_structure(now_[i], s.p, s.q);
}

void Breeder::evaluate() {
    for (std::size_t i = 0; i < now_.size(); ++i) candidates_[i] = decode(now_[i], genome_);
    batch_.errors(candidates_, costs_);
    for (std::size_t i = 0; i < now_.size(); ++i) costs_[i] = fitness(costs_[i], candidates_[i].structure, settings_.weights);
    evaluations_ += now_.size();
}

std::size_t Breeder::best_of(std::size_t first, std::size_t count) const {
    std::size_t best = first;
    for (std::size_t i = first + 1; i < first + count; ++i)
        if (costs_[i] < costs_[best]) best = i;
    return best;
}

void Breeder::breed(std::span<const Group> groups) {
    const int words = now_.words();
    const auto copy = [&](const Word* from, Word* to) { std::copy(from, from + words, to); };
    const Word cross_below = threshold(settings_.crossover);
    for (const Group& g : groups) {
        const auto elites = std::min(static_cast<std::size_t>(g.elites), static_cast<std::size_t>(g.count));
        if (elites > 0) {
            std::iota(ranking_.begin(), ranking_.begin() + g.count, g.first);
            std::partial_sort(ranking_.begin(), ranking_.begin() + static_cast<std::ptrdiff_t>(elites), ranking_.begin() + g.count,
                              [&](std::size_t i, std::size_t j) {
                                  return costs_[i] < costs_[j] || (costs_[i] == costs_[j] && i < j);
                              });
            for (std::size_t k = 0; k < elites; ++k) copy(now_[ranking_[k]], next_[g.first + k]);
        }
        for (std::size_t k = elites; k < g.count; k += 2) {
            const Word* mother = now_[tournament(random_, costs_.data(), g.first, g.count, settings_.tournament)];
            const Word* father = now_[tournament(random_, costs_.data(), g.first, g.count, settings_.tournament)];
            Word* const child1 = next_[g.first + k];
            Word* const child2 = k + 1 < g.count ? next_[g.first + k + 1] : spare_.data();
            if (random_.word() < cross_below) {
                crossover(random_, genome_.starts(), words, mother, father, child1, child2);
            } else {
                copy(mother, child1);
                copy(father, child2);
            }
            // Parents of one species carry the same structure bits, so only mutation could change them.
            const int first_bit = g.fixed_structure ? 2 * genome_.structure_bits() : 0;
            mutation_.apply(random_, child1, first_bit, genome_.bits());
            if (child2 != spare_.data()) mutation_.apply(random_, child2, first_bit, genome_.bits());
        }
    }
    now_.swap(next_);
}

namespace {

// The paper's run: one population, every structure in it; the best candidate ever seen is reported.
Trial run_plain(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, Progress& progress) {
    Breeder breeder(experiment, genome, settings, random);
    const auto n = static_cast<std::size_t>(settings.population);
    const Breeder::Group all[] = {{0, static_cast<std::uint32_t>(n), settings.elites, false}};
    Trial trial;
    trial.history.reserve(static_cast<std::size_t>(settings.generations));
    trial.best.resize(static_cast<std::size_t>(genome.words()));
    breeder.randomise(0, n);
    breeder.evaluate();
    for (int g = 0;; ++g) {
        const std::size_t best = breeder.best_of(0, n);
        trial.history.push_back(breeder.cost(best));
        if (breeder.cost(best) < trial.best_fitness) {
            trial.best_fitness = breeder.cost(best);
            trial.best_generation = g;
            std::copy(breeder[best], breeder[best] + genome.words(), trial.best.begin());
        }
        note(progress, 1, trial.best_fitness);
        if (g + 1 == settings.generations) break;
        breeder.generation(all);
    }
    trial.evaluations = breeder.evaluations();
    return trial;
}

}  // namespace

void parallel(std::size_t n, int workers, const std::function<void(std::size_t)>& work) {
    const std::size_t threads = std::min(n, static_cast<std::size_t>(std::max(1, workers)));
    std::atomic<std::size_t> next{0};
    std::exception_ptr error;
    std::mutex lock;
    const auto loop = [&] {
        const FlushDenormals flush;
        for (std::size_t i = next++; i < n; i = next++) {
            try {
                work(i);
            } catch (...) {
                const std::lock_guard<std::mutex> guard(lock);
                if (!error) error = std::current_exception();
                next = n;
            }
        }
    };
    std::vector<std::thread> pool;
    for (std::size_t t = 1; t < threads; ++t) pool.emplace_back(loop);
    loop();
    for (std::thread& t : pool) t.join();
    if (error) std::rethrow_exception(error);
}

std::vector<Trial> search(const Experiment& experiment, const SearchRanges& ranges, const Settings& settings, int trials,
                          std::uint64_t seed, int workers, Progress& progress) {
    experiment.check();
    settings.check();
    if (trials < 1) throw std::invalid_argument("trials must be at least 1");
    const bool held = experiment.loop.kind != LoopKind::continuous;
    if (held && ranges.p_min < 1)
        throw std::invalid_argument("p must be at least 1 in the sampled loop and in open loop: a plant that passes its torque "
                                    "straight through does not exist behind a hold");
    const Genome genome(ranges, settings.code, settings.roots);
    std::vector<Trial> result(static_cast<std::size_t>(trials));
    const int inner = trials >= workers ? 1 : workers / trials;
    parallel(result.size(), workers, [&](std::size_t i) {
        const Random random = Random::stream(seed, i);
        result[i] = settings.species ? run_species(experiment, genome, settings, random, inner, progress)
                                     : run_plain(experiment, genome, settings, random, progress);
    });
    return result;
}

}  // namespace gaident
