#include "check.hpp"
#include "gaident/estimation/parameters.hpp"
#include "gaident/reference/drives.hpp"

using namespace gaident;

namespace {

SearchRanges ranges() {
    SearchRanges r;
    r.gain = {1e3, 2e4};
    r.real = {0.5, 60.0};
    r.imaginary = {5.0, 250.0};
    return r;
}

Factors<double> random_factors(Random& random, Structure s, double size) {
    reference::Plant g =
        reference::random_plant(random, static_cast<std::size_t>(s.p), static_cast<std::size_t>(s.q),
                                random.below(2) == 0 ? reference::Family::ordinary : reference::Family::unstable, size, 250);
    g.K = reference::log_uniform(random, 10.0, 1e6);
    return reference::factors_of(g);
}

template <class Use>
void each_structure(Use&& use) {
    for (int p = 0; p <= 7; ++p)
        for (int q = 0; q <= 7; ++q) use(Structure{p, q});
}

}  // namespace

TEST_CASE("parameters: pack and unpack are inverse") {
    Random random(121);
    each_structure([&](Structure s) {
        const Factors<double> f = random_factors(random, s, 1e-3);
        const std::vector<double> starts{1.0, -2.0, 3.0}, x = pack(f, starts);
        CHECK(x.size() == static_cast<std::size_t>(s.parameters()) + 3);
        CHECK(std::vector<double>(x.end() - 3, x.end()) == starts);
        const Factors<double> back = unpack(x, s);
        CHECK(back.structure == s);
        CHECK_NEAR(back.gain, f.gain, 1e-13 * f.gain);
        std::vector<double> again = pack(back, starts);
        CHECK_NEAR(again[0], x[0], 1e-13);
        again[0] = x[0];
        CHECK(again == x);
    });
}

TEST_CASE("parameters: project brings every root and the gain inside, and moves nothing that is inside already") {
    Random random(122);
    const SearchRanges r = ranges();
    for (int repeat = 0; repeat < 5; ++repeat)
        each_structure([&](Structure s) {
            std::vector<double> x = pack(random_factors(random, s, 2e-3), {7.0});
            project(x, s, r);
            CHECK(x.back() == 7.0);
            const Factors<double> f = unpack(x, s);
            const Range gain = r.gain_limits(s.p);
            CHECK(f.gain >= gain.lo * (1 - 1e-12) && f.gain <= gain.hi * (1 + 1e-12));
            std::complex<double> poles[max_plant_order], zeros[max_pairs];
            roots_of(f, poles, zeros);
            const auto inside = [&](std::complex<double> a) {
                // Two equal real roots, both at one end, come back from e1 and e0 with half of their digits.
                CHECK(-a.real() >= r.real.lo - 1e-5 && -a.real() <= r.real.hi + 1e-5);
                CHECK(std::abs(a.imag()) <= r.imaginary.hi * (1 + 1e-9));
            };
            for (int i = 0; i < s.poles(); ++i) inside(poles[i]);
            for (int i = 0; i < s.q; ++i) inside(zeros[i]);
            std::vector<double> again = x;
            project(again, s, r);
            for (std::size_t i = 0; i < x.size(); ++i) CHECK_NEAR(again[i], x[i], 1e-6 * std::abs(x[i]) + 1e-12);
        });
}

TEST_CASE("parameters: project leaves inner points alone to the bit") {
    Factors<double> f;
    f.structure = {1, 2};
    f.gain = 6545.29;
    f.pole_pair[0] = conjugate_pair(10.3, 150.9);
    f.pole = 15.41;
    f.zero_pair[0] = real_pair(4.26, 33.0);
    const std::vector<double> before = pack(f, {0.25});
    std::vector<double> x = before;
    project(x, f.structure, ranges());
    CHECK(x == before);
}

TEST_CASE("parameters: at_bounds names the parameters at an end of their range") {
    const SearchRanges r = ranges();
    const Structure s{1, 2};
    Factors<double> f;
    f.structure = s;
    f.gain = 6000.0;
    f.pole_pair[0] = conjugate_pair(10.0, 100.0);
    f.pole = 20.0;
    f.zero_pair[0] = conjugate_pair(5.0, 90.0);
    const auto flags = [&] { return at_bounds(pack(f, {}), s, r); };
    using Flags = std::vector<bool>;
    CHECK((flags() == Flags{false, false, false, false, false, false}));
    f.gain = r.gain.hi;
    CHECK((flags() == Flags{true, false, false, false, false, false}));
    f.gain = 6000.0;
    f.pole_pair[0] = conjugate_pair(r.real.lo, 100.0);
    CHECK((flags() == Flags{false, true, false, false, false, false}));
    f.pole_pair[0] = conjugate_pair(10.0, r.imaginary.hi);
    CHECK((flags() == Flags{false, false, true, false, false, false}));
    f.pole_pair[0] = real_pair(10.0, r.real.lo);  // e0 stands for the slower root
    CHECK((flags() == Flags{false, false, true, false, false, false}));
    f.pole_pair[0] = real_pair(r.real.hi, 10.0);
    CHECK((flags() == Flags{false, true, false, false, false, false}));
    f.pole_pair[0] = conjugate_pair(10.0, 100.0);
    f.pole = r.real.lo;
    CHECK((flags() == Flags{false, false, false, true, false, false}));
    f.pole = 20.0;
    f.zero_pair[0] = conjugate_pair(r.real.hi, r.imaginary.hi);
    CHECK((flags() == Flags{false, false, false, false, true, true}));
}

TEST_CASE("parameters: every step is positive, small, and of its own parameter's size") {
    Random random(123);
    each_structure([&](Structure s) {
        const std::vector<double> x = pack(random_factors(random, s, 1e-3), {12.0, 0.0});
        const auto n = static_cast<std::size_t>(s.parameters());
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double h = step_size(x, s, 2.0, i);
            CHECK(h > 0.0 && h < 1e-5 * (std::abs(x[i]) + 1e7));
            if (i > 0 && i < n) CHECK(h >= 0.99e-6 * std::min(std::abs(x[i]), 2.0));
        }
        CHECK(step_size(x, s, 2.0, 0) == 1e-6);
        CHECK_NEAR(step_size(x, s, 2.0, n), 12e-6, 1e-18);
        CHECK_NEAR(step_size(x, s, 2.0, n + 1), 1e-9, 1e-20);
    });
    // A root at the origin takes the step of the slowest root that a record can show.
    Factors<double> f;
    f.structure = {1, 2};
    f.gain = 1.0;
    const std::vector<double> x = pack(f, {});
    CHECK_NEAR(step_size(x, f.structure, 2.0, 1), 2e-6, 1e-18);
    CHECK_NEAR(step_size(x, f.structure, 2.0, 2), 4e-6, 1e-18);
    CHECK_NEAR(step_size(x, f.structure, 2.0, 3), 2e-6, 1e-18);
}
