#include "check.hpp"
#include "gaident/reference/drives.hpp"

#include <algorithm>

using namespace gaident;
using Complex = std::complex<double>;

namespace {

// Largest distance between two sets of roots, nearest ones first, relative to the largest root.
double distance(std::vector<Complex> a, std::vector<Complex> b) {
    double worst = 0.0, size = 1e-300;
    for (const Complex x : a) {
        const auto nearest =
            std::min_element(b.begin(), b.end(), [&](Complex u, Complex v) { return std::abs(u - x) < std::abs(v - x); });
        worst = std::max(worst, std::abs(*nearest - x));
        size = std::max(size, std::abs(x));
        b.erase(nearest);
    }
    return worst / size;
}

}  // namespace

TEST_CASE("factors: a structure counts its pairs") {
    for (int p = 0; p <= 7; ++p)
        for (int q = 0; q <= 7; ++q) {
            const Structure s{p, q};
            CHECK(s.poles() == p + q && 2 * s.pole_pairs() + (s.single_pole() ? 1 : 0) == p + q);
            CHECK(2 * s.zero_pairs() + (s.single_zero() ? 1 : 0) == q);
            CHECK(s.parameters() == 1 + p + 2 * q);
        }
}

TEST_CASE("factors: a pair and its numbers") {
    Complex a, b;
    split(conjugate_pair(3.0, 4.0), a, b);
    CHECK(a == Complex(3.0, 4.0) && b == Complex(3.0, -4.0));
    split(real_pair(2.0, 5.0), a, b);
    CHECK(a == 5.0 && b == 2.0);
    split(real_pair(0.0, 0.0), a, b);
    CHECK(a == 0.0 && b == 0.0);
    split(real_pair(7.0, 0.0), a, b);
    CHECK(a == 7.0 && b == 0.0);
    split(real_pair(-7.0, 2.0), a, b);
    CHECK_NEAR(a.real(), -7.0, 1e-14);
    CHECK_NEAR(b.real(), 2.0, 1e-14);
    // No cancellation: twelve decades between the two.
    split(real_pair(1e8, 1e-4), a, b);
    CHECK_NEAR(a.real(), 1e8, 1e-7);
    CHECK_NEAR(b.real(), 1e-4, 1e-19);
    split(real_pair(-1e8, -1e-4), a, b);
    CHECK_NEAR(b.real(), -1e-4, 1e-19);
    split({0.0, -4.0}, a, b);
    CHECK(a.real() * b.real() == -4.0 && a + b == 0.0);
}

TEST_CASE("factors: roots into factors and back") {
    Random random(21);
    double worst = 0.0;
    for (int repeat = 0; repeat < 3000; ++repeat) {
        const std::size_t p = random.below(8), q = random.below(8);
        const reference::Plant g = reference::random_plant(random, p, q, reference::families[repeat % 2 == 0 ? 0 : 3], 1e-3, 250);
        const Factors<double> f = reference::factors_of(g);
        CHECK(f.structure == Structure{static_cast<int>(p), static_cast<int>(q)});
        std::vector<Complex> poles, zeros;
        for (const Complex a : g.A1) poles.push_back(-a);
        for (const Complex a : g.A2) poles.push_back(-a);
        for (const Complex b : g.B2) zeros.push_back(-b);
        std::vector<Complex> poles_back(p + q), zeros_back(q);
        roots_of(f, poles_back.data(), zeros_back.data());
        worst = std::max({worst, distance(poles, poles_back), distance(zeros, zeros_back)});
    }
    CHECK(worst < 1e-6);  // two real roots may nearly coincide
}

TEST_CASE("factors: order of the roots does not matter; wrong sets are refused") {
    const Complex poles[] = {{-1.0, 5.0}, {-3.0, 0.0}, {-1.0, -5.0}}, zeros[] = {{-2.0, -4.0}, {-2.0, 4.0}};
    const Factors<double> f = factors_from_roots(2.0, poles, zeros);
    CHECK((f.structure == Structure{1, 2}));
    CHECK(f.gain == 2.0 && f.pole == 3.0);
    CHECK(f.pole_pair[0].e1 == 2.0 && f.pole_pair[0].e0 == 26.0);
    CHECK(f.zero_pair[0].e1 == 4.0 && f.zero_pair[0].e0 == 20.0);
    const Complex lonely[] = {{-1.0, 5.0}, {-1.0, 5.0}};
    CHECK_THROWS(factors_from_roots(1.0, lonely, {}), std::invalid_argument);
    CHECK_THROWS(factors_from_roots(1.0, {}, zeros), std::invalid_argument);
    const std::vector<Complex> many(15, Complex(-1.0)), eight(8, Complex(-1.0)), fourteen(14, Complex(-1.0));
    CHECK_THROWS(factors_from_roots(1.0, many, {}), std::invalid_argument);
    CHECK_THROWS(factors_from_roots(1.0, fourteen, eight), std::invalid_argument);
    CHECK(factors_from_roots(1.0, fourteen, {}).structure.p == 14);
}
