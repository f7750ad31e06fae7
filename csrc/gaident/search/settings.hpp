// What a genetic search is told, what it runs with, and what it reports.
#pragma once

#include "../numeric/rng.hpp"
#include "../runtime/parallel.hpp"
#include "../runtime/stop.hpp"
#include "objective.hpp"

#include <stdexcept>
#include <string>

namespace gaident {

struct Settings {
    int population = 50;
    int tournament = 2;
    double crossover = 0.9;
    double mutation = 0.01;
    int generations = 1000;  // with species: at most so many, in rounds
    int elites = 0;          // with species: one per species, always
    int round = 40;          // with species: generations between two local searches in every species
    int quiet_rounds = 1;    // with species: rounds that find no better optimum, after which the search ends

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
    std::vector<double> history;       // least cost in each generation; with species: up to it
    double best_fitness = worst_cost;  // ever seen by the genetic search
    int best_generation = 0;
    std::vector<Word> best;       // its chromosome
    std::size_t evaluations = 0;  // candidates evaluated by the genetic search
    std::size_t overflows = 0;    // of them, those whose evaluation left the range of its arithmetic (Evaluator::overflows)
};

template <class Fit>
struct SpeciesTrial : Trial {
    std::vector<Fit> species;  // the local optimum of each species that was asked for, in their order
};

struct Progress {
    std::atomic<std::size_t> done{0};  // generations, of all trials together
    std::atomic<double> best{worst_cost};
    std::atomic<std::size_t> species{0};  // those that compete; 0: none are kept apart
    std::atomic<int> leading{-1};         // the species of the least local optimum so far; -1: none yet
    // Where set, called at the end of each note() by the thread that notes: for a caller without a second thread to look with.
    void (*noted)(const Progress&) = nullptr;

    void note(std::size_t generations, double cost_now) {
        done += generations;
        double seen = best.load();
        while (cost_now < seen && !best.compare_exchange_weak(seen, cost_now)) {
        }
        if (noted != nullptr) noted(*this);
    }

    // Trials that run side by side may report in the same moment; the species is for the eye only.
    void lead(std::size_t which, double cost) {
        double seen = least_.load();
        while (cost < seen && !least_.compare_exchange_weak(seen, cost)) {
        }
        if (cost < seen) leading = static_cast<int>(which);
    }

private:
    std::atomic<double> least_{worst_cost};
};

// What the machine gives a search: none of it changes the result.
struct Resources {
    Workers& workers;
    Progress& progress;
    const std::atomic<bool>* stop = nullptr;  // where set, Stopped is thrown before the next generation
    WordStream::Fill words = mixed_words;     // random words, by the instruction set that there is
};

}  // namespace gaident
