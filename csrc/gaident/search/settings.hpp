// What a genetic run is told, and what it reports.
#pragma once

#include "../genetic/fitness.hpp"
#include "../genetic/genome.hpp"
#include "../estimation/refine.hpp"

#include <string>

namespace gaident {

struct Settings {
    int population = 50;
    int tournament = 2;
    double crossover = 0.9;
    double mutation = 0.01;
    int generations = 1000;  // with species: at most so many, in rounds
    int elites = 0;          // with species: one per species, always
    Code code = Code::binary;
    Scale roots = Scale::linear;
    FitnessWeights weights;
    bool species = false;  // one species per structure, local fits, comparison left to the caller
    int round = 40;        // generations between two local fits of every species
    int quiet_rounds = 1;  // rounds that find no better optimum, after which the search ends
    bool in_float = false;
    std::string mirror;  // name of a drive's arithmetic (mirror.hpp) to evaluate in; empty: none

    void check() const {
        const auto bad = [](const std::string& what) { throw std::invalid_argument("Settings: " + what); };
        if (population < 2 || population > 1000000) bad("population must be 2..1000000");
        if (tournament < 1 || tournament > population) bad("tournament must be 1..population");
        if (!(crossover >= 0.0 && crossover <= 1.0)) bad("crossover must be 0..1");
        if (!(mutation == 0.0 || (mutation >= 1e-6 && mutation <= 1.0))) bad("mutation must be 0 or 1e-6..1");
        if (generations < 1 || generations > 10000000) bad("generations must be 1..10000000");
        if (elites < 0 || elites >= population) bad("elites must be 0..population-1");
        if (round < 1 || quiet_rounds < 1) bad("round and quiet_rounds must be at least 1");
    }
};

struct Trial {
    std::vector<double> history;          // best fitness (equation 6) in each generation
    double best_fitness = worst_fitness;  // ever seen by the genetic search
    int best_generation = 0;
    std::vector<Word> best;        // its chromosome
    std::vector<Refined> species;  // with species: the local fit of each structure, by p + q, then q
    std::size_t evaluations = 0;   // candidates simulated by the genetic search
    std::size_t overflows = 0;     // of them, in a drive's arithmetic, those that left its range or diverged
};

struct Progress {
    std::atomic<std::size_t> done{0};  // generations, of all trials together
    std::atomic<double> best{worst_fitness};
    std::atomic<std::size_t> species{0};            // structures that compete; 0: none are kept apart
    std::atomic<int> leading_p{-1}, leading_q{-1};  // the structure of the least error sum so far; -1: none yet

    void note(std::size_t generations, double fitness_now) {
        done += generations;
        double seen = best.load();
        while (fitness_now < seen && !best.compare_exchange_weak(seen, fitness_now)) {
        }
    }

    // Trials that run side by side may report in the same moment; p and q are for the eye only.
    void lead(const Structure& structure, double error_sum) {
        double seen = least_.load();
        while (error_sum < seen && !least_.compare_exchange_weak(seen, error_sum)) {
        }
        if (error_sum < seen) {
            leading_p = structure.p;
            leading_q = structure.q;
        }
    }

private:
    std::atomic<double> least_{worst_fitness};
};

}  // namespace gaident
