// gaident.h on the search of paper_search.hpp.
#include "gaident.h"

#include "../gaident/numeric/denormals.hpp"
#include "paper_search.hpp"

#include <new>

using namespace gaident;

// Opaque for C.
struct gaident_search {
    PaperSearch search;
};

extern "C" {

gaident_settings gaident_paper_settings(gaident_loop loop) {
    return {
        .loop = loop, .seed = 0, .crossover = 0.9, .mutation = 0.01, .tournament = 2, .error_weight = 1.0, .order_weight = 2.0};
}

int gaident_version() { return GAIDENT_H_VERSION; }

size_t gaident_bytes() { return sizeof(gaident_search); }

gaident_search* gaident_configure(void* memory, size_t bytes, const gaident_settings* s) {
    const auto rate = [](double x) { return x >= 0.0 && x <= 1.0; };
    const auto positive = [](double x) { return x > 1e-30 && x < 1e30; };  // in any arithmetic
    if (memory == nullptr || s == nullptr || bytes < sizeof(gaident_search)) return nullptr;
    if (reinterpret_cast<uintptr_t>(memory) % alignof(gaident_search) != 0) return nullptr;
    const gaident_loop& loop = s->loop;
    const gaident_controller& controller = loop.controller;
    if (!positive(controller.kp) || !(controller.ki == 0.0 || positive(controller.ki))) return nullptr;
    if (!positive(loop.sample_time) || !positive(loop.peak)) return nullptr;
    if (!rate(s->crossover) || !rate(s->mutation) || (s->mutation > 0.0 && s->mutation < 1e-6)) return nullptr;
    if (s->tournament < 1 || s->tournament > population) return nullptr;
    if (!positive(s->error_weight) || !positive(s->error_weight * s->error_weight)) return nullptr;
    if (!(s->order_weight >= 0.0 && s->order_weight < 1e30)) return nullptr;
    const FlushDenormals flush;
    StaticSetup<InDrive> setup = paper_setup();
    setup.controller.kp = controller.kp;
    setup.controller.ki = controller.ki;
    setup.clock.period = loop.sample_time;
    setup.peak = loop.peak;
    setup.tournament = s->tournament;
    setup.crossover = s->crossover;
    setup.mutation = s->mutation;
    setup.weights = {s->error_weight, s->order_weight};
    setup.seed = s->seed;
    return new (memory) gaident_search{PaperSearch(setup)};
}

int gaident_feed(gaident_search* g, double command, double velocity) { return g->search.feed(command, velocity) ? 1 : 0; }

int gaident_ready(const gaident_search* g) { return !g->search.full() ? 0 : (g->search.spoiled() ? -1 : 1); }

int gaident_work(gaident_search* g, int individuals) {
    const FlushDenormals flush;
    return g->search.full() ? g->search.work(individuals) : 0;
}

int gaident_run(gaident_search* g, int generations) {
    const FlushDenormals flush;
    if (!g->search.full()) return 0;
    for (int k = 0; k < generations; ++k) g->search.generation();
    return g->search.generations();
}

int gaident_best(const gaident_search* g, gaident_model* model) {
    if (!(g->search.best_fitness() < InDrive::worst())) return 0;
    const Factors<Number> f = g->search.best_model();
    const auto number = [](const Number& x) { return static_cast<double>(x); };
    const auto pair = [&](const Pair<Number>& x) { return gaident_pair{number(x.e1), number(x.e0)}; };
    *model = {};
    model->p = f.structure.p;
    model->q = f.structure.q;
    model->gain = number(f.gain);
    for (int i = 0; i < f.structure.pole_pairs(); ++i) model->pole_pairs[i] = pair(f.pole_pair[i]);
    for (int i = 0; i < f.structure.zero_pairs(); ++i) model->zero_pairs[i] = pair(f.zero_pair[i]);
    if (f.structure.single_pole()) model->pole = number(f.pole);
    if (f.structure.single_zero()) model->zero = number(f.zero);
    model->fitness = number(g->search.best_fitness());
    model->generation = g->search.best_generation();
    model->generations = g->search.generations();
    return 1;
}
}
