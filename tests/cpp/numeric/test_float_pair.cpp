#include "check.hpp"
#include "gaident/numeric/float_pair.hpp"
#include "gaident/numeric/rng.hpp"

using namespace gaident;

namespace {

double value(FloatPair x) { return static_cast<double>(x); }

}  // namespace

TEST_CASE("float_pair: every operation to 2^-44 of the exact result, sizes far apart and nearly cancelling") {
    Random random(1);
    double worst = 0.0;
    for (int i = 0; i < 200000; ++i) {
        const double x = std::ldexp(random.uniform() - 0.5, static_cast<int>(random.below(40)) - 20);
        const double other = std::ldexp(random.uniform() - 0.5, static_cast<int>(random.below(40)) - 20);
        const FloatPair a(x), b(i % 4 == 0 ? -x * (1.0 + 1e-6 * other) : other);
        const double u = value(a), v = value(b);
        CHECK(std::abs(u - x) <= 0x1p-47 * std::abs(x));
        const auto note = [&](FloatPair found, double exact, double scale) {
            worst = std::max(worst, std::abs(value(found) - exact) / scale);
        };
        note(a + b, u + v, std::abs(u) + std::abs(v));
        note(a - b, u - v, std::abs(u) + std::abs(v));
        note(a * b, u * v, std::abs(u * v));
        note(a / b, u / v, std::abs(u / v));
        CHECK(value(-a) == -u);
        CHECK((a < b) == (u < v));
        CHECK(value(clamp(a, FloatPair(-0.1), FloatPair(0.2))) == (u < value(FloatPair(-0.1))  ? value(FloatPair(-0.1))
                                                                   : u > value(FloatPair(0.2)) ? value(FloatPair(0.2))
                                                                                               : u));
    }
    std::printf("worst %.2g of the exact result\n", worst);
    CHECK(worst < 0x1p-44);
}

TEST_CASE("float_pair: infinite limits clamp nothing, and overflow is not a number one could take for a result") {
    const double inf = std::numeric_limits<double>::infinity();
    CHECK(value(clamp(FloatPair(3.25), -FloatPair(inf), FloatPair(inf))) == 3.25);
    CHECK(!std::isfinite(value(FloatPair(1e30) * FloatPair(1e30))));
}
