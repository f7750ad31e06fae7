#include "check.hpp"
#include "gaident/batch.hpp"
#include "gaident/parallel.hpp"

#include <stdexcept>

using namespace gaident;

TEST_CASE("parallel: parallel does everything once, and throws the first exception again") {
    for (const int workers : {-1, 0, 1, 2, 5, 40}) {
        std::vector<std::atomic<int>> done(17);
        parallel(done.size(), workers, [&](std::size_t i) { ++done[i]; });
        for (const auto& d : done) CHECK(d == 1);
        std::atomic<int> begun{0};
        bool caught = false;
        try {
            parallel(1000, workers, [&](std::size_t i) {
                ++begun;
                if (i == 996) throw std::range_error("late");
            });
        } catch (const std::range_error& e) {
            caught = std::string(e.what()) == "late";
        }
        CHECK(caught);
        CHECK(workers > 1 || begun == 4);  // the last is begun first
        CHECK_THROWS(parallel(5, workers, [](std::size_t) { throw Stopped{}; }), Stopped);
    }
    parallel(0, 4, [](std::size_t) { CHECK(false); });
}
