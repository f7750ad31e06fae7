#include "check.hpp"
#include "gaident/simulation/batch.hpp"
#include "gaident/runtime/parallel.hpp"

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

namespace {

// Comes back once `count` pieces are in here at the same time.
void meet(std::atomic<int>& here, int count) {
    ++here;
    while (here < count) std::this_thread::yield();
}

}  // namespace

TEST_CASE("parallel: helpers begin with the first shared work, and stay") {
    Workers workers(3);
    workers.share(1, [](std::size_t) {});
    workers.share(0, [](std::size_t) {});
    CHECK(workers.helpers() == 0);
    for (int again = 0; again < 100; ++again) {
        std::atomic<int> here{0};
        workers.share(3, [&](std::size_t) { meet(here, 3); });
        CHECK(workers.helpers() == 2);
    }
}

TEST_CASE("parallel: who has nothing left to do helps with work that is shared inside work") {
    Workers workers(2);
    for (const std::size_t sharing : {0, 1})  // begun by the caller, or by its helper
        for (int again = 0; again < 50; ++again) {
            std::atomic<int> here{0}, inner{0}, done{0};
            workers.share(2, [&](std::size_t i) {
                meet(here, 2);
                if (i == sharing) workers.share(2, [&](std::size_t) { meet(inner, 2); });
                ++done;
            });
            CHECK(inner == 2 && done == 2);
        }
    // Errors come through from inside.
    CHECK_THROWS(workers.share(2, [&](std::size_t) { workers.share(3, [](std::size_t) { throw Stopped{}; }); }), Stopped);
    std::atomic<int> sum{0};
    workers.share(
        20, [&](std::size_t i) { workers.share(i, [&](std::size_t k) { workers.share(k, [&](std::size_t) { ++sum; }); }); });
    CHECK(sum == 1140);  // of i (i - 1) / 2, i < 20
}

TEST_CASE("parallel: steps of a strand follow one another, whoever takes them") {
    for (const int count : {1, 2, 3, 8}) {
        Workers workers(count);
        std::vector<std::size_t> at(3, 0);  // not atomic: one at a time
        std::atomic<int> wrong{0};
        workers.share_strands(3, 500, [&](std::size_t strand, std::size_t step) {
            if (at[strand]++ != step) ++wrong;
        });
        CHECK(wrong == 0 && (at == std::vector<std::size_t>{500, 500, 500}));
        CHECK_THROWS(workers.share_strands(3, 5,
                                           [](std::size_t, std::size_t step) {
                                               if (step == 2) throw Stopped{};
                                           }),
                     Stopped);
        workers.share_strands(0, 5, [](std::size_t, std::size_t) { CHECK(false); });
    }
    // Two strands are at work at once.
    std::atomic<int> here{0};
    Workers(2).share_strands(2, 1, [&](std::size_t, std::size_t) { meet(here, 2); });
    CHECK(here == 2);
}

TEST_CASE("parallel: helpers flush denormals") {
    const volatile double small = 1e-300;
    std::atomic<int> here{0}, flushed{0};
    Workers(2).share(2, [&](std::size_t) {
        meet(here, 2);
        if (small * 1e-10 == 0.0) ++flushed;
    });
    CHECK(flushed == 2);
    CHECK(small * 1e-10 != 0.0);
}
