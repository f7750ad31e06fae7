// The paper's run in a drive: the two-mass record, 50 individuals, 1000 generations.
// Says per generation the smallest cost and a hash of the whole population with its costs, all in bits, so that two machines can
// be compared line by line; lines with # are this machine's own.
#include "../gaident/numeric/denormals.hpp"
#include "paper_search.hpp"
#include "record.hpp"  // made by make_tables.cpp
#include "say.hpp"

#include <new>

using namespace gaident;

namespace {

constexpr int generations = 1000;

std::uint64_t bits(const Number& x) { return std::bit_cast<std::uint64_t>(static_cast<double>(x)); }

// FNV-1a over 64-bit words.
std::uint64_t hash(const PaperSearch& search) {
    std::uint64_t h = 0xCBF29CE484222325ULL;
    const auto take = [&h](std::uint64_t word) { h = (h ^ word) * 0x100000001B3ULL; };
    for (int w = 0; w < population * 4; ++w) take(search.chromosomes()[w]);
    for (int i = 0; i < population; ++i) take(bits(search.costs()[i]));
    return h;
}

alignas(PaperSearch) unsigned char memory[sizeof(PaperSearch)];

// A search of the record, or of one with another command: then the recurrence has an input, and takes longest.
PaperSearch& searching(bool constant_command) {
    StaticSetup<InDrive> setup = paper_setup();
    setup.controller.kp = recorded_kp;
    setup.controller.ki = recorded_ki;
    setup.clock.period = recorded_sample_time;
    setup.peak = 50.0;
    setup.seed = 1;
    PaperSearch& search = *new (memory) PaperSearch(setup);
    for (int k = 0; k < record_samples; ++k)
        search.feed(constant_command || k < 125 ? recorded_command[k] : 0.0, recorded_velocity[k]);
    return search;
}

// Instructions of the longest slices seen.
struct Longest {
    std::uint64_t evaluation = 0, breeding = 0;
};

// One generation in slices of one individual; returns its instructions.
std::uint64_t generation(PaperSearch& search, Longest& longest) {
    std::uint64_t all = 0;
    const int before = search.generations();
    for (bool evaluating = false; search.generations() == before; evaluating = true) {
        const std::uint64_t begin = board_instructions();
        search.work(1);  // the first breeds (or draws the first population), the others evaluate
        const std::uint64_t took = board_instructions() - begin;
        all += took;
        std::uint64_t& most = evaluating ? longest.evaluation : longest.breeding;
        if (took > most) most = took;
    }
    return all;
}

}  // namespace

int main() {
    const FlushDenormals flush;
    Line line;
    const std::uint64_t before = board_instructions();
    PaperSearch& search = searching(true);
    const std::uint64_t setup = board_instructions() - before;
    std::uint64_t all = 0, most = 0;
    Longest longest, driven;
    for (int g = 0; g < generations; ++g) {
        const std::uint64_t took = generation(search, longest);
        all += took;
        if (took > most) most = took;
        (line << "generation " << static_cast<std::uint64_t>(g) << " cost ").hex(bits(search.least_cost()));
        (line << " population ").hex(hash(search)) << "\n";
        line.say();
    }
    line << "best of generation " << static_cast<std::uint64_t>(search.best_generation()) << " chromosome";
    for (int w = 0; w < 4; ++w) (line << " ").hex(search.best()[w]);
    (line << " fitness ").hex(bits(search.best_fitness())) << "\n";
    line.say();
    const Factors<Number> f = search.best_model();
    (line << "p " << static_cast<std::uint64_t>(f.structure.p) << " q " << static_cast<std::uint64_t>(f.structure.q) << " K ")
            .hex(bits(f.gain))
        << "\n";
    line.say();

    PaperSearch& other = searching(false);
    for (int g = 0; g < 5; ++g) generation(other, driven);  // every structure is among the first
    (line << "another command: population ").hex(hash(other)) << "\n";
    line.say();

    line << "# instructions: configure and feed " << setup << ", per generation mean " << all / generations << " most " << most
         << "; longest slices: breeding " << longest.breeding << ", evaluation of one " << longest.evaluation
         << ", of one under any command " << driven.evaluation << "\n";
    line.say();
    return 0;
}
