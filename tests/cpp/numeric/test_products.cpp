#include "check.hpp"
#include "gaident/simulation/kernels/kernels.hpp"
#include "gaident/numeric/rng.hpp"

using namespace gaident;

namespace {

constexpr std::size_t W = double_lanes;

std::vector<double> random_rows(Random& random, std::size_t n) {
    std::vector<double> rows(n * W);
    for (double& v : rows) v = random.uniform() - 0.5;
    return rows;
}

}  // namespace

TEST_CASE("products: every kernel set equals the formula bit for bit, and goes on from what is there") {
    Random random(121);
    for (const char* name : {"baseline", "avx2", "avx512"}) {
        const Kernels* const kernels = kernels_named(name);
        if (kernels == nullptr) continue;
        for (const std::size_t n : {0U, 1U, 2U, 7U, 64U, 511U}) {
            const std::vector<double> a = random_rows(random, n), b = random_rows(random, n);
            std::vector<double> sums = random_rows(random, W), expected = sums;
            kernels->gram(a.data(), b.data(), n, sums.data());
            for (std::size_t i = 0; i < W; ++i)
                for (std::size_t j = 0; j < W; ++j) {
                    double part = 0.0;
                    for (std::size_t k = 0; k < n; ++k) part = gaident::fma(a[k * W + i], b[k * W + j], part);
                    expected[i * W + j] += part;
                }
            CHECK(sums == expected);

            std::vector<double> output(n), rows = a, scale = random_rows(random, 1);
            for (double& v : output) v = random.uniform();
            kernels->differences(scale.data(), output.data(), n, rows.data());
            for (std::size_t k = 0; k < n; ++k)
                for (std::size_t l = 0; l < W; ++l)
                    CHECK(rows[k * W + l] == (l == 0 ? output[k] - a[k * W] : scale[l] * (a[k * W] - a[k * W + l])));

            for (const std::size_t order : {0U, 1U, 5U}) {
                std::vector<double> phi(order);
                for (double& v : phi) v = 0.3 * (random.uniform() - 0.5);
                const std::vector<double> past = random_rows(random, order + n);  // `order` rows of history in front
                std::vector<double> white(n * W), coloured = past;
                kernels->whiten(phi.data(), order, past.data() + order * W, n, white.data());
                kernels->colour(phi.data(), order, white.data(), n, coloured.data() + order * W);
                for (std::size_t k = 0; k < n; ++k)
                    for (std::size_t l = 0; l < W; ++l) {
                        double v = past[(order + k) * W + l];
                        for (std::size_t i = 0; i < order; ++i) v = gaident::fnma(phi[i], past[(order + k - 1 - i) * W + l], v);
                        CHECK(white[k * W + l] == v);
                        // Colouring undoes whitening where both have the same past.
                        CHECK_NEAR(coloured[(order + k) * W + l], past[(order + k) * W + l], 1e-14);
                    }
            }
        }
    }
}
