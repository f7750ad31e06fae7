#include "check.hpp"
#include "gaident/numeric/linear.hpp"
#include "gaident/numeric/rng.hpp"

using namespace gaident;

TEST_CASE("linear: every damping lane solves its own system, and one that is not positive definite steps nowhere") {
    Random random(112);
    double factors[damping_lanes];
    for (std::size_t l = 0; l < damping_lanes; ++l) factors[l] = l == 0 ? 0.0 : std::pow(10.0, static_cast<double>(l) - 4.0);
    std::vector<double> work;
    for (std::size_t n = 1; n <= 12; ++n) {
        std::vector<double> G(n * n), A(n * n, 0.0), b(n), s(n * damping_lanes);
        for (double& g : G) g = random.uniform() - 0.5;
        for (double& v : b) v = random.uniform() - 0.5;
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < n; ++j)
                for (std::size_t k = 0; k < n; ++k) A[i * n + j] += G[k * n + i] * G[k * n + j];
            A[i * n + i] += 0.1;
        }
        solve_damped(A, b, factors, work, s);
        for (std::size_t l = 0; l < damping_lanes; ++l)
            for (std::size_t i = 0; i < n; ++i) {
                double left = factors[l] * A[i * n + i] * s[i * damping_lanes + l];
                for (std::size_t j = 0; j < n; ++j) left += A[i * n + j] * s[j * damping_lanes + l];
                CHECK_NEAR(left, b[i], 1e-11);
            }
    }
    // Singular without damping, sound with it; a matrix of no numbers in every lane.
    const std::vector<double> singular{1.0, 1.0, 1.0, 1.0}, right{1.0, 2.0}, nan{std::nan(""), 0.0, 0.0, 1.0};
    std::vector<double> s(2 * damping_lanes, 7.0);
    solve_damped(singular, right, factors, work, s);
    for (std::size_t l = 0; l < damping_lanes; ++l) {
        CHECK((s[l] == 0.0) == (l == 0));
        CHECK(std::isfinite(s[l]) && std::isfinite(s[damping_lanes + l]));
    }
    solve_damped(nan, right, factors, work, s);
    for (const double v : s) CHECK(v == 0.0);
}
