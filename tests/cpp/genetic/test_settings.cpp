#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/identification/plant_search.hpp"

using namespace gaident;

TEST_CASE("settings: the defaults are Table II") {
    const PlantSettings s;
    s.check();
    CHECK(s.population == 50 && s.tournament == 2 && s.crossover == 0.9 && s.mutation == 0.01 && s.generations == 1000);
    CHECK(s.elites == 0 && s.code == Code::binary && s.roots == Scale::linear && !s.species && !s.in_float);
    CHECK(s.weights.error == 1.0 && s.weights.order == 2.0);
}

TEST_CASE("settings: settings and spaces that make no sense are refused") {
    const Bench bench(reference::paper_drive(true), 0.3, 17);
    const auto refused = [&](auto&& change) {
        PlantSettings s;
        s.generations = 5;
        change(s);
        Progress progress;
        CHECK_THROWS(search_plant(bench.experiment, SearchRanges{}, s, 1, 1, 1, progress), std::invalid_argument);
    };
    const double nan = std::nan("");
    refused([](PlantSettings& s) { s.population = 1; });
    refused([](PlantSettings& s) { s.tournament = 0; });
    refused([](PlantSettings& s) { s.tournament = 51; });
    refused([](PlantSettings& s) { s.crossover = 1.1; });
    refused([&](PlantSettings& s) { s.crossover = nan; });
    refused([](PlantSettings& s) { s.mutation = -0.1; });
    refused([&](PlantSettings& s) { s.mutation = nan; });
    refused([](PlantSettings& s) { s.generations = 0; });
    refused([](PlantSettings& s) { s.elites = 50; });
    refused([](PlantSettings& s) { s.round = 0; });
    refused([](PlantSettings& s) { s.quiet_rounds = 0; });
    Progress progress;
    CHECK_THROWS(search_plant(bench.experiment, SearchRanges{}, PlantSettings{}, 0, 1, 1, progress), std::invalid_argument);
    Experiment open = bench.experiment;
    open.loop.kind = LoopKind::open;
    CHECK_THROWS(search_plant(open, SearchRanges{}, PlantSettings{}, 1, 1, 1, progress),
                 std::invalid_argument);  // p = 0 has no held form
    CHECK_THROWS(search_plant(Experiment{}, SearchRanges{}, PlantSettings{}, 1, 1, 1, progress), std::invalid_argument);
}
