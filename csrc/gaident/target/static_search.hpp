// The paper's search (Table II) with all its memory inside the object: no heap, no libm, no exceptions, sizes known when
// compiled.
// What runs in a drive, in slices, while the drive does its work; the random words are drawn in the order of breeder.hpp, so the
// same seed gives the run that the host makes.
//
//     StaticSearch(setup)         once
//     feed(command, velocity)     sample by sample, until it says that the record is full
//     work(n)                     n individuals evaluated, or one population bred; again and again
//     best(), best_fitness()      at any time
//
// One task may feed and another one work, on one processor or on two, once it has seen full().
// All else is for the task that works.
#pragma once

#include "candidate.hpp"
#include "../genetic/operators.hpp"

#include <atomic>

namespace gaident {

template <class A>
struct StaticSetup {
    const Genome* genome = nullptr;
    GeneValues<typename A::Number> values;
    Controller controller;  // without limits
    Clock clock;
    double peak = 0.0;  // largest command or velocity to be expected [rad/s]; 0, for floats only: any
    int tournament = 2;
    double crossover = 0.9, mutation = 0.01;
    FitnessWeights weights;
    std::uint64_t seed = 0, stream = 0;
};

template <class A, int population, int max_samples, int words = 4>
class StaticSearch {
public:
    using Number = typename A::Number;
    using Sample = typename A::Sample;

    static_assert(A::room >= 4.0, "a velocity of twice the peak, less a command of as much, has to fit");

    explicit StaticSearch(const StaticSetup<A>& s)
        : setup_(s),
          scaling_(Extent{s.peak, max_samples, &s.genome->ranges(), s.controller, s.clock}),
          weights_(s.weights),
          random_(Random::stream(s.seed, s.stream)),
          mutation_(s.mutation, random_),
          limit_(s.peak > 0.0 ? 2.0 * s.peak : std::numeric_limits<double>::max()) {
        if (s.genome->words() != words) wrong_use("StaticSearch: the genome has another number of words");
        if (A::room <= std::numeric_limits<double>::max() && !(s.peak > 0.0))
            wrong_use("StaticSearch: this arithmetic needs the record's peak");
    }
    StaticSearch(const StaticSearch&) = delete;

    // Whether there was room for the sample [rad/s].
    // One that is not finite or beyond twice the peak, whose deviation from the command a word may not represent, spoils the
    // record: no model comes of it.
    bool feed(double command, double velocity) {
        const int k = samples();
        if (k == max_samples) return false;
        spoiled_ = spoiled_ || !within(command) || !within(velocity);
        command_[k] = A::sample(command, scaling_);
        velocity_[k] = A::sample(velocity, scaling_);
        samples_.store(k + 1, std::memory_order_release);
        return true;
    }
    bool full() const { return samples() == max_samples; }
    int samples() const { return samples_.load(std::memory_order_acquire); }
    bool spoiled() const { return spoiled_; }

    // Goes on by at most `n` individuals; returns the number of generations evaluated so far.
    // A slice ends where a population is bred, too, so the longest is that of `n` evaluations or of one breeding, whichever takes
    // longer.
    int work(int n) {
        if (!begun_) begin();
        else if (next_individual_ == population) breed();
        else
            for (; n > 0 && next_individual_ < population; --n) evaluate();
        return generations_;
    }
    int generation() {
        const int before = generations_;
        while (generations_ == before) work(population);
        return generations_;
    }

    int generations() const { return generations_; }
    int best_generation() const { return best_generation_; }
    const Number& best_fitness() const { return best_fitness_; }
    const Word* best() const { return best_; }
    Factors<Number> best_model() const { return decode<A>(best_, *setup_.genome, setup_.values); }

    // As evaluated last: the population's chromosomes one after the other, their costs, the smallest of these.
    const Word* chromosomes() const { return now_; }
    const Number* costs() const { return costs_; }
    const Number& least_cost() const { return costs_[least_]; }

private:
    static constexpr std::size_t all_words = std::size_t{population} * words;

    bool within(double x) const { return x >= -limit_ && x <= limit_; }

    void begin() {
        begun_ = true;
        const int n = samples();
        settles_ = n > 0;
        for (int i = 1; i < n; ++i) settles_ = settles_ && command_[i] == command_[0];
        if (settles_)
            for (int i = 0; i < n; ++i)
                velocity_[i] = A::store(A::signal(velocity_[i], scaling_) - A::signal(command_[0], scaling_));
        for (std::size_t w = 0; w < all_words; ++w) now_[w] = random_.word();
    }

    void evaluate() {
        const Word* const c = now_ + next_individual_ * words;
        const Factors<Number> factors = decode<A>(c, *setup_.genome, setup_.values);
        const RecordView<A> record{command_, velocity_, static_cast<std::size_t>(samples()), settles_};
        const Delta<Number> loop = close_loop(bilinear_plant(factors, setup_.clock.period), setup_.controller, setup_.clock);
        typename A::State x[max_loop_order];
        gaident::begin<A>(loop, factors.structure, record, scaling_, x);
        costs_[next_individual_] = weights_.fitness(A::error(squared_errors<A>(loop, x, record, scaling_)), factors.structure);
        if (costs_[next_individual_] < costs_[least_] || next_individual_ == 0) least_ = next_individual_;
        if (++next_individual_ < population) return;
        if (!spoiled_ && costs_[least_] < best_fitness_) {
            best_fitness_ = costs_[least_];
            best_generation_ = generations_;
            for (int w = 0; w < words; ++w) best_[w] = now_[least_ * words + w];
        }
        ++generations_;
    }

    void breed() {
        const Mating mating{0, population, setup_.tournament, threshold(setup_.crossover)};
        Word spare[words];
        mate(random_, mating, setup_.genome->starts(), words, now_, costs_, 0, next_, spare);
        mutation_.apply(random_, next_, words, population, 0, setup_.genome->bits());
        for (std::size_t w = 0; w < all_words; ++w) now_[w] = next_[w];
        next_individual_ = 0;
    }

    StaticSetup<A> setup_;
    typename A::Scaling scaling_;
    Weights<A> weights_;
    Random random_;
    Mutation mutation_;
    double limit_;  // of a sample [rad/s]
    Sample command_[max_samples], velocity_[max_samples];
    std::atomic<int> samples_{0};  // the last word that feed() writes: who sees it sees the samples
    bool spoiled_ = false, begun_ = false, settles_ = false;
    Word now_[all_words], next_[all_words];
    Number costs_[population];
    int next_individual_ = 0, least_ = 0, generations_ = 0, best_generation_ = 0;
    Number best_fitness_ = A::worst();
    Word best_[words] = {};
};

}  // namespace gaident
