#include "check.hpp"
#include "gaident/simulation/fitness.hpp"

using namespace gaident;

TEST_CASE("fitness: equation (6) with the paper's weights and with others") {
    CHECK(fitness(100.0, {1, 2}, {}) == 106.0);
    CHECK(fitness(100.0, {0, 0}, {}) == 100.0);
    CHECK(fitness(10.0, {3, 3}, {2.0, 0.5}) == 43.0);  // Wf1 weighs the error, so its square the sum
}

TEST_CASE("fitness: a diverged candidate is the worst, never NaN or infinite") {
    const double inf = std::numeric_limits<double>::infinity();
    for (const double sum : {inf, std::nan(""), -std::nan(""), worst_fitness}) {
        CHECK(sane(sum) == worst_fitness);
        CHECK(fitness(sum, {3, 3}, {}) == worst_fitness);
        CHECK(fitness(sum, {3, 3}, {10.0, 2.0}) == worst_fitness);
    }
    CHECK(sane(1.5) == 1.5 && sane(0.0) == 0.0);
    CHECK(fitness(1e300, {1, 0}, {}) < worst_fitness);
}
