#include "check.hpp"
#include "gaident/linear.hpp"
#include "gaident/rng.hpp"

using namespace gaident;

TEST_CASE("linear: sum of products of any length") {
    Random random(111);
    for (std::size_t n = 0; n < 40; ++n) {
        std::vector<double> x(n), y(n);
        long double sum = 0.0, size = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            x[i] = random.uniform() - 0.5;
            y[i] = random.uniform() - 0.5;
            sum += static_cast<long double>(x[i]) * y[i];
            size += std::abs(static_cast<long double>(x[i]) * y[i]);
        }
        CHECK_NEAR(dot(x.data(), y.data(), n), static_cast<double>(sum), 1e-14 * static_cast<double>(size));
    }
}

TEST_CASE("linear: solves a positive definite system, and says when there is none") {
    Random random(112);
    for (std::size_t n = 1; n <= 12; ++n) {
        std::vector<double> G(n * n), A(n * n, 0.0), x(n), b(n, 0.0);
        for (double& g : G) g = random.uniform() - 0.5;
        for (std::size_t i = 0; i < n; ++i) {
            x[i] = random.uniform() - 0.5;
            for (std::size_t j = 0; j < n; ++j)
                for (std::size_t k = 0; k < n; ++k) A[i * n + j] += G[k * n + i] * G[k * n + j];
            A[i * n + i] += 0.1;
        }
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < n; ++j) b[i] += A[i * n + j] * x[j];
        CHECK(solve_spd(A, b, n));
        for (std::size_t i = 0; i < n; ++i) CHECK_NEAR(b[i], x[i], 1e-11);
    }
    std::vector<double> singular{1.0, 1.0, 1.0, 1.0}, right{1.0, 2.0}, nan{std::nan(""), 0.0, 0.0, 1.0};
    CHECK(!solve_spd(singular, right, 2));
    CHECK(!solve_spd(nan, right, 2));
}
