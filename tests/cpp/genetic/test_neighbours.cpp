#include "check.hpp"
#include "gaident/identification/neighbours.hpp"
#include "gaident/reference/drives.hpp"

using namespace gaident;

namespace {

// G(0)-like limits of a plant relative to another one's: how the low and the high frequencies changed.
double low(const Factors<double>& f) {
    double x = f.gain;
    for (int i = 0; i < f.structure.pole_pairs(); ++i) x /= f.pole_pair[i].e0;
    if (f.structure.single_pole()) x /= f.pole;
    for (int i = 0; i < f.structure.zero_pairs(); ++i) x *= f.zero_pair[i].e0;
    if (f.structure.single_zero()) x *= f.zero;
    return x;
}

}  // namespace

TEST_CASE("neighbours: a grown structure is the smaller one and a module that changes one end of the frequencies at most") {
    Random random(141);
    const SearchRanges ranges;
    for (int p = 0; p <= 3; ++p)
        for (int q = 0; q <= 3; ++q) {
            reference::Plant g = reference::random_plant(random, static_cast<std::size_t>(p), static_cast<std::size_t>(q),
                                                         reference::Family::ordinary, 2e-3, 250);
            g.K = 5000.0;
            const Factors<double> from = reference::factors_of(g);
            for (int dp = -1; dp <= 3; ++dp)
                for (int dq = -1; dq <= 3; ++dq) {
                    const Structure to{p + dp, q + dq};
                    if (to.p < 0 || to.q < 0) continue;
                    const auto made = grow(from, to, ranges, 4.0, 5000.0);
                    const bool one_module = (dp == 0 && (dq == 1 || dq == 2)) || (dq == 0 && (dp == 1 || dp == 2));
                    CHECK(made.empty() != one_module);
                    for (const Factors<double>& f : made) {
                        CHECK(f.structure == to);
                        CHECK(f.gain > 0.0 && std::isfinite(f.gain));
                        const bool low_kept = std::abs(low(f) / low(from) - 1.0) < 1e-9;
                        const bool high_kept = dp == 0 && std::abs(f.gain / from.gain - 1.0) < 1e-9;
                        CHECK(low_kept || high_kept);
                    }
                }
        }
    // Nothing to see between the slowest and the fastest: nothing is made.
    CHECK(grow(reference::paper_drive(false).factors(), {1, 2}, ranges, 300.0, 200.0).empty());
}

TEST_CASE("neighbours: taking away what was added gives the smaller structure back") {
    Random random(142);
    int checked = 0;
    for (int p = 1; p <= 3; ++p)
        for (int q = 0; q <= 3; ++q) {
            reference::Plant g = reference::random_plant(random, static_cast<std::size_t>(p), static_cast<std::size_t>(q),
                                                         reference::Family::ordinary, 2e-3, 250);
            g.K = 5000.0;
            const Factors<double> from = reference::factors_of(g);
            for (const auto& [dp, dq] : {std::pair{0, 1}, {0, 2}, {1, 0}, {2, 0}})
                for (const Factors<double>& larger : grow(from, {p + dp, q + dq}, SearchRanges{}, 4.0, 5000.0)) {
                    const auto smaller = shrink(larger, from.structure);
                    CHECK(!smaller.empty());
                    double least = 1e300;
                    for (const Factors<double>& f : smaller) {
                        CHECK(f.structure == from.structure);
                        CHECK_NEAR(low(f) / low(larger), 1.0, 1e-9);  // the gain at standstill is kept
                        double distance = 0.0;
                        for (int i = 0; i < f.structure.pole_pairs(); ++i)
                            distance += std::abs(f.pole_pair[i].e0 / from.pole_pair[i].e0 - 1.0);
                        if (f.structure.single_pole()) distance += std::abs(f.pole / from.pole - 1.0);
                        least = std::min(least, distance);
                    }
                    checked += least < 1e-9 ? 1 : 0;
                }
        }
    // Real roots are gathered anew into pairs, so not every factor comes back as it was; most do.
    CHECK(checked > 1000);
    CHECK(shrink(reference::paper_drive(true).factors(), {1, 1}).empty());  // no real zero to take
    CHECK(shrink(reference::paper_drive(true).factors(), {1, 3}).empty());
    CHECK(shrink(reference::paper_drive(true).factors(), {1, 0}).size() == 1);
}
