#include "check.hpp"
#include "gaident/numeric/rng.hpp"

#include <array>

using namespace gaident;

// The words below were computed by a few lines of Python with integers of any size, from the definition at the head
// of rng.hpp.
TEST_CASE("rng: the words of a key are fixed to the bit") {
    const std::array<std::uint64_t, 4> key0 = {0xE220A8397B1DCDAFULL, 0x6E789E6AA1B965F4ULL, 0x06C45D188009454FULL,
                                               0xF88BB8A8724C81ECULL};
    const std::array<std::uint64_t, 4> key1 = {0x910A2DEC89025CC1ULL, 0xBEEB8DA1658EEC67ULL, 0xF893A2EEFB32555EULL,
                                               0x71C18690EE42C90BULL};
    Random zero(0), one(1);
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(zero.word() == key0[i]);
        CHECK(one.word() == key1[i]);
    }
}

TEST_CASE("rng: the streams of a seed are fixed to the bit") {
    const auto first = [](std::uint64_t seed, std::uint64_t stream) { return Random::stream(seed, stream).word(); };
    CHECK(first(0, 0) == 0x568A9B0B1A2C05ECULL);
    CHECK(first(0, 1) == 0x238275BC38FCBE91ULL);
    CHECK(first(1, 0) == 0x6EC85F1F8547BC0CULL);
    Random r = Random::stream(2024, 7);
    CHECK(r.word() == 0xC3C043F62B92D627ULL);
    CHECK(r.word() == 0xD067E18E2B1A64BAULL);
}

TEST_CASE("rng: a block of words is the words one by one") {
    Random a(42), b(42);
    std::array<std::uint64_t, 37> block{};
    for (const std::size_t n : {1U, 0U, 37U, 5U}) {
        a.words(block.data(), n);
        for (std::size_t i = 0; i < n; ++i) CHECK(block[i] == b.word());
    }
    CHECK(a.word() == b.word());
}

TEST_CASE("rng: below and uniform take the top bits of one word") {
    Random r(0);
    for (const std::uint32_t expected : {883U, 431U, 26U, 970U, 106U, 327U}) CHECK(r.below(1000) == expected);
    Random u(0);
    CHECK(u.uniform() == 0.8833108082136426);
    CHECK(u.uniform() == 0.43152799704850997);
    CHECK(u.uniform() == 0.026433771592597743);
}

TEST_CASE("rng: below stays in its range, with every number in it") {
    Random r(3);
    for (const std::uint32_t n : {1U, 2U, 3U, 50U, 0xFFFFFFFFU}) {
        std::uint32_t largest = 0;
        for (int i = 0; i < 1000; ++i) {
            const std::uint32_t x = r.below(n);
            CHECK(x < n);
            largest = std::max(largest, x);
        }
        CHECK(n > 50 || largest == n - 1);
        CHECK(n <= 50 || largest > n / 100 * 99);
    }
}

TEST_CASE("rng: even, in every bit and in every eighth") {
    constexpr int n = 100000;
    Random r(7);
    std::array<int, 64> ones{};
    std::array<int, 8> eighths{}, pairs{};
    int before = 0;
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
        const std::uint64_t w = r.word();
        for (std::size_t b = 0; b < 64; ++b) ones[b] += static_cast<int>((w >> b) & 1);
        const int now = static_cast<int>(w >> 61);
        ++eighths[static_cast<std::size_t>(now)];
        ++pairs[static_cast<std::size_t>((now - before) & 7)];
        before = now;
        const double u = r.uniform();
        CHECK(u >= 0.0 && u < 1.0);
        sum += u;
    }
    // five standard deviations
    for (const int k : ones) CHECK_NEAR(k, n / 2, 5.0 * std::sqrt(n * 0.25));
    for (const int k : eighths) CHECK_NEAR(k, n / 8, 5.0 * std::sqrt(n / 8.0));
    for (const int k : pairs) CHECK_NEAR(k, n / 8, 5.0 * std::sqrt(n / 8.0));
    CHECK_NEAR(sum / n, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / n));
}

TEST_CASE("rng: a probability as a threshold") {
    CHECK(threshold(0.0) == 0);
    CHECK(threshold(-1.0) == 0);
    CHECK(threshold(std::nan("")) == 0);
    CHECK(threshold(0.5) == 0x8000000000000000ULL);
    CHECK(threshold(0.25) == 0x4000000000000000ULL);
    CHECK(threshold(1.0) == ~0ULL);
    CHECK(threshold(1.0 - 0x1.0p-53) == 0xFFFFFFFFFFFFF800ULL);
}
