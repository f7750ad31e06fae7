#include "check.hpp"
#include "gaident/plant/bilinear.hpp"
#include "gaident/reference/drives.hpp"

using namespace gaident;
using Complex = std::complex<long double>;

namespace {

Complex transfer(const reference::Plant& g, Complex s) {
    Complex G = g.K;
    for (const auto a : g.A1) G /= s + Complex(a);
    for (std::size_t j = 0; j < g.A2.size(); ++j) G *= (s + Complex(g.B2[j])) / (s + Complex(g.A2[j]));
    return G;
}

}  // namespace

TEST_CASE("bilinear: H(delta) = G(2/Ts (z-1)/(z+1)) at any frequency") {
    Random random(31);
    double worst = 0.0;
    for (int repeat = 0; repeat < 4000; ++repeat) {
        const double Ts = reference::log_uniform(random, 1e-4, 2e-3);
        const auto p = random.below(8), q = random.below(8);
        const auto family = reference::families[random.below(4)];
        reference::Plant g = reference::random_plant(random, p, q, family, Ts, 250);
        g.K = reference::log_uniform(random, 1e-3, 1e6);
        const Delta<double> h = bilinear_plant(reference::factors_of(g), Ts);
        CHECK(h.order == static_cast<int>(p + q));
        for (int k = 0; k < 10; ++k) {
            // Any z will do; near the unit circle, where the loop lives, but not next to a pole.
            const Complex z = std::polar(static_cast<long double>(reference::uniform(random, 1.2, 1.5)),
                                         static_cast<long double>(reference::uniform(random, 0.0, 3.0)));
            const Complex delta = z - 1.0L;
            Complex n = h.b[0], d = 1.0L;
            long double size = std::abs(n), size_d = 1.0L;  // what may have cancelled
            for (int i = 0; i < h.order; ++i) {
                n = n * delta + Complex(h.b[i + 1]);
                d = d * delta + Complex(h.a[i]);
                size = size * std::abs(delta) + std::abs(h.b[i + 1]);
                size_d = size_d * std::abs(delta) + std::abs(h.a[i]);
            }
            const Complex G = transfer(g, 2.0L / static_cast<long double>(Ts) * delta / (z + 1.0L));
            const long double allowed = size / std::abs(n) + size_d / std::abs(d);
            worst = std::max(worst, static_cast<double>(std::abs(n / d / G - 1.0L) / allowed));
        }
    }
    std::printf("largest deviation of the transfer function, in its own condition: %.2g\n", worst);
    CHECK(worst < 1e-14);
}

TEST_CASE("bilinear: one mass in figures") {
    // K/(s + a): y(n) = y(n-1) (c-a)/(c+a) + K/(c+a) (u(n) + u(n-1))
    const Factors<double> g = factors_from_roots(6278.26, std::vector<std::complex<double>>{-34.13}, {});
    const double Ts = 0.444e-3, c = 2.0 / Ts, a = 34.13;
    const Delta<double> h = bilinear_plant(g, Ts);
    CHECK_NEAR(h.b[0], 6278.26 / (c + a), 1e-15);
    CHECK_NEAR(h.b[1], 2.0 * 6278.26 / (c + a), 1e-15);
    CHECK_NEAR(h.a[0], 2.0 * a / (c + a), 1e-17);
}

TEST_CASE("bilinear: the gain at standstill is that of G(s)") {
    Random random(32);
    for (int repeat = 0; repeat < 500; ++repeat) {
        reference::Plant g =
            reference::random_plant(random, random.below(8), random.below(8), reference::Family::ordinary, 1e-3, 250);
        g.K = 5.0;
        const Delta<double> h = bilinear_plant(reference::factors_of(g), 1e-3);
        const double dc = static_cast<double>(transfer(g, 0.0L).real());
        const double found = h.order > 0 ? h.b[h.order] / h.a[h.order - 1] : h.b[0];
        CHECK_NEAR(found / dc, 1.0, 1e-13);
    }
}
