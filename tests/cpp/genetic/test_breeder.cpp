#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/identification/velocity_objective.hpp"
#include "gaident/search/breeder.hpp"

#include <cstdlib>
#include <new>

// ------------------------------------------------------------- every allocation of this program is counted

namespace {

std::atomic<long> allocations{0};

void* allocate(std::size_t n, std::size_t alignment) {
    ++allocations;
    const std::size_t size = (n + alignment - 1) / alignment * alignment;
#if defined(_WIN32)
    if (void* p = _aligned_malloc(size > 0 ? size : alignment, alignment)) return p;
#else
    if (void* p = std::aligned_alloc(alignment, size > 0 ? size : alignment)) return p;
#endif
    throw std::bad_alloc();
}

// Not inlined: the compiler would see a free() of what operator new returned, and warn.
#if defined(_WIN32)
[[gnu::noinline]] void release(void* p) { _aligned_free(p); }
#else
[[gnu::noinline]] void release(void* p) { std::free(p); }
#endif

}  // namespace

void* operator new(std::size_t n) { return allocate(n, alignof(std::max_align_t)); }
void* operator new[](std::size_t n) { return allocate(n, alignof(std::max_align_t)); }
void* operator new(std::size_t n, std::align_val_t a) { return allocate(n, static_cast<std::size_t>(a)); }
void* operator new[](std::size_t n, std::align_val_t a) { return allocate(n, static_cast<std::size_t>(a)); }
void operator delete(void* p) noexcept { release(p); }
void operator delete[](void* p) noexcept { release(p); }
void operator delete(void* p, std::size_t) noexcept { release(p); }
void operator delete[](void* p, std::size_t) noexcept { release(p); }
void operator delete(void* p, std::align_val_t) noexcept { release(p); }
void operator delete[](void* p, std::align_val_t) noexcept { release(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { release(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { release(p); }

using namespace gaident;

TEST_CASE("breeder: generations equal the referee's bit for bit; odd groups, elites, fixed structures, no crossover") {
    const Bench bench(two_mass());
    struct Plan {
        int population, elites, tournament;
        double crossover, mutation;
        std::vector<Breeder::Group> groups;
    };
    const std::vector<Plan> plans = {
        {50, 0, 2, 0.9, 0.01, {{0, 50, 0, false}}},
        {51, 1, 3, 0.9, 0.02, {{0, 51, 1, false}}},
        {51, 0, 2, 0.9, 0.05, {{0, 51, 0, false}}},
        {20, 0, 2, 0.0, 0.0, {{0, 20, 0, false}}},
        {20, 0, 1, 1.0, 1.0, {{0, 20, 0, false}}},
        {31, 1, 2, 0.9, 0.05, {{0, 7, 1, true}, {7, 4, 1, true}, {11, 1, 1, true}, {12, 19, 2, false}}}};
    for (const Plan& plan : plans)
        for (const int bits : {10, 16}) {
            SearchRanges ranges;
            ranges.bits = bits;
            PlantSettings s;
            s.code = Code::gray;
            s.population = plan.population;
            s.tournament = plan.tournament;
            s.crossover = plan.crossover;
            s.mutation = plan.mutation;
            const VelocityObjective objective(bench.experiment, ranges, s);
            const Genome& genome = objective.genome();
            Breeder breeder(objective, s, Random(77), bench.experiment.kernels->words);
            const auto n = static_cast<std::size_t>(plan.population);
            breeder.randomise(0, n);
            breeder.evaluate();

            Random random(77);
            reference::Mutation mutation(plan.mutation, random);
            std::vector<reference::Bits> now(n);
            for (auto& c : now) {
                std::vector<Word> words(static_cast<std::size_t>(genome.words()));
                random.words(words.data(), words.size());
                c = reference::unpack(words.data(), genome.bits());
            }
            for (int g = 0; g < 8; ++g) {
                for (std::size_t i = 0; i < n; ++i) CHECK(reference::unpack(breeder[i], genome.bits()) == now[i]);
                std::vector<double> cost(n);
                for (std::size_t i = 0; i < n; ++i) cost[i] = breeder.cost(i);
                breeder.generation(plan.groups);

                // The paper's generation: select, cross, mutate; the best of a group go on unchanged where asked for.
                std::vector<reference::Bits> next(n);
                for (const auto& group : plan.groups) {
                    const std::size_t last = group.first + group.count;
                    std::vector<bool> taken(n, false);
                    std::size_t child = group.first;
                    for (int k = 0; k < group.elites && child < last; ++k, ++child) {
                        std::size_t best = n;
                        for (std::size_t i = group.first; i < last; ++i)
                            if (!taken[i] && (best == n || cost[i] < cost[best])) best = i;
                        taken[best] = true;
                        next[child] = now[best];
                    }
                    const std::size_t first_child = child;
                    while (child < last) {
                        const auto mother = now[reference::tournament(random, cost, group.first, group.count, plan.tournament)];
                        const auto father = now[reference::tournament(random, cost, group.first, group.count, plan.tournament)];
                        reference::Bits first = mother, second = father;
                        if (random.word() < threshold(plan.crossover))
                            reference::crossover(random, genome.fields(), mother, father, first, second);
                        next[child++] = first;
                        if (child < last) next[child++] = second;
                    }
                    const std::size_t from = group.one_species ? 4 : 0;
                    for (std::size_t i = first_child; i < last; ++i) mutation.apply(random, next[i], from, next[i].size());
                }
                now = next;
            }
        }
}

TEST_CASE("breeder: a generation allocates nothing, in any loop and arithmetic") {
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled, LoopKind::open})
        for (const bool limited : {false, true})
            for (const bool in_float : {false, true}) {
                reference::Drive d = two_mass(kind, 600);
                if (limited) d.loop.controller.torque_limit = 3.0;
                Bench bench(d);
                bench.experiment.records.push_back(bench.experiment.records[0]);
                bench.experiment.records[1].start = Start::steady;
                SearchRanges ranges;
                ranges.p_min = 1;
                PlantSettings s;
                s.code = Code::gray;
                s.roots = Scale::logarithmic;
                s.population = 49;
                s.in_float = in_float;
                const VelocityObjective objective(bench.experiment, ranges, s);
                Breeder breeder(objective, s, Random(5));
                const Breeder::Group groups[] = {{0, 7, 1, true}, {7, 42, 2, false}};
                const long before = allocations;
                breeder.randomise(0, 49);
                for (std::size_t i = 0; i < 7; ++i) objective.genome().set_structure(breeder[i], 1, 2);
                breeder.evaluate();
                for (int g = 0; g < 10; ++g) breeder.generation(groups);
                CHECK(allocations == before);
            }
    const long before = allocations;
    delete new int(3);
    CHECK(allocations == before + 1);  // the counter counts
}
