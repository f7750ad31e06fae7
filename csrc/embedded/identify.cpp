// The paper's run in a drive: the two-mass record, 50 individuals, 1000 generations. Says per generation the smallest cost and a hash of
// the whole population with its costs, all in bits, so that two machines can be compared line by line; lines with # are this machine's own.
#include "../gaident/denormals.hpp"
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

}  // namespace

int main() {
    const FlushDenormals flush;
    Line line;
    const std::uint64_t before_setup = board_instructions();
    StaticSetup<InDrive> setup = paper_setup();
    setup.kp = recorded_kp;
    setup.ki = recorded_ki;
    setup.sample_time = recorded_sample_time;
    setup.peak = 50.0;
    setup.seed = 1;
    PaperSearch& search = *new (memory) PaperSearch(setup);
    for (int k = 0; k < record_samples; ++k) search.feed(recorded_command[k], recorded_velocity[k]);
    const std::uint64_t setup_took = board_instructions() - before_setup;

    std::uint64_t all = 0, most = 0, most_in_slice = 0, most_in_breeding = 0;
    for (int g = 0; g < generations; ++g) {
        std::uint64_t took = 0;
        for (bool evaluating = false; search.generations() == g; evaluating = true) {
            const std::uint64_t before = board_instructions();
            search.work(1);  // the first of a generation breeds (or draws the first population), the others evaluate
            const std::uint64_t slice = board_instructions() - before;
            took += slice;
            std::uint64_t& longest = evaluating ? most_in_slice : most_in_breeding;
            if (slice > longest) longest = slice;
        }
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
    line << "# instructions: configure and feed " << setup_took << ", per generation mean " << all / generations << " most "
         << most << ", longest evaluation of one " << most_in_slice << ", longest breeding " << most_in_breeding << "\n";
    line.say();
    return 0;
}
