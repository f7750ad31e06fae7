#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/search/engine.hpp"

using namespace gaident;

TEST_CASE("settings: the defaults are Table II") {
    const Settings s;
    s.check();
    CHECK(s.population == 50 && s.tournament == 2 && s.crossover == 0.9 && s.mutation == 0.01 && s.generations == 1000);
    CHECK(s.elites == 0 && s.code == Code::binary && s.roots == Scale::linear && !s.species && !s.in_float);
    CHECK(s.weights.error == 1.0 && s.weights.order == 2.0);
}

TEST_CASE("settings: settings and spaces that make no sense are refused") {
    const Bench bench(reference::paper_drive(true), 0.3, 17);
    const auto refused = [&](auto&& change) {
        Settings s;
        s.generations = 5;
        change(s);
        Progress progress;
        CHECK_THROWS(search(bench.experiment, SearchRanges{}, s, 1, 1, 1, progress), std::invalid_argument);
    };
    const double nan = std::nan("");
    refused([](Settings& s) { s.population = 1; });
    refused([](Settings& s) { s.tournament = 0; });
    refused([](Settings& s) { s.tournament = 51; });
    refused([](Settings& s) { s.crossover = 1.1; });
    refused([&](Settings& s) { s.crossover = nan; });
    refused([](Settings& s) { s.mutation = -0.1; });
    refused([&](Settings& s) { s.mutation = nan; });
    refused([](Settings& s) { s.generations = 0; });
    refused([](Settings& s) { s.elites = 50; });
    refused([](Settings& s) { s.round = 0; });
    refused([](Settings& s) { s.quiet_rounds = 0; });
    Progress progress;
    CHECK_THROWS(search(bench.experiment, SearchRanges{}, Settings{}, 0, 1, 1, progress), std::invalid_argument);
    Experiment open = bench.experiment;
    open.loop.kind = LoopKind::open;
    CHECK_THROWS(search(open, SearchRanges{}, Settings{}, 1, 1, 1, progress),
                 std::invalid_argument);  // p = 0 has no held form
    CHECK_THROWS(search(Experiment{}, SearchRanges{}, Settings{}, 1, 1, 1, progress), std::invalid_argument);
}
