#include "check.hpp"
#include "gaident/genetic/operators.hpp"
#include "gaident/reference/bits.hpp"

using namespace gaident;

namespace {

std::vector<Genome> genomes() {
    std::vector<Genome> all;
    for (const int bits : {10, 7, 16, 3})
        for (const int most : {3, 7}) {
            SearchRanges s;
            s.bits = bits;
            s.p_max = s.q_max = most;
            all.emplace_back(s, Code::binary, Scale::linear);
        }
    return all;
}

std::vector<Word> random_words(Random& random, int n) {
    std::vector<Word> c(static_cast<std::size_t>(n));
    random.words(c.data(), c.size());
    return c;
}

}  // namespace

TEST_CASE("operators: tournament equals the referee, ties included") {
    Random setup(1);
    for (int repeat = 0; repeat < 3000; ++repeat) {
        std::vector<double> cost(60);
        const std::uint32_t levels = 1 + setup.below(8);  // few levels: many ties
        for (double& c : cost) c = setup.below(levels);
        const std::uint32_t count = 1 + setup.below(50);
        const std::size_t first = setup.below(60 - count + 1);
        const int size = 1 + static_cast<int>(setup.below(6));
        Random a(static_cast<std::uint64_t>(repeat)), b = a;
        const std::size_t winner = tournament(a, cost.data(), first, count, size);
        CHECK(winner == reference::tournament(b, cost, first, count, size));
        CHECK(winner >= first && winner < first + count);
        CHECK(a.word() == b.word());
    }
}

TEST_CASE("operators: on a tie the contestant drawn first wins; a NaN never beats a number") {
    Random a(5), b(5);
    const std::vector<double> equal(10, 1.0);
    CHECK(tournament(a, equal.data(), 0, 10, 4) == b.below(10));
    const std::vector<double> cost = {3.0, 1.0, 2.0};
    Random r(6);
    for (int i = 0; i < 200; ++i) CHECK(tournament(r, cost.data(), 0, 3, 40) == 1);
}

TEST_CASE("operators: a tournament of two wins with the odds of the ranks") {
    // Of n distinct costs, rank k (0 the best) wins with probability (2 (n-k) - 1) / n^2.
    constexpr std::size_t n = 5;
    constexpr int draws = 50000;
    const std::vector<double> cost = {0.0, 1.0, 2.0, 3.0, 4.0};
    int wins[n] = {};
    Random r(8);
    for (int i = 0; i < draws; ++i) ++wins[tournament(r, cost.data(), 0, n, 2)];
    for (std::size_t k = 0; k < n; ++k) {
        const double p = static_cast<double>(2 * (n - k) - 1) / static_cast<double>(n * n);
        CHECK_NEAR(wins[k], draws * p, 5.0 * std::sqrt(draws * p * (1.0 - p)));
    }
}

TEST_CASE("operators: running parity") {
    Random r(9);
    for (int repeat = 0; repeat < 200; ++repeat) {
        const Word x = r.word() & r.word(), y = running_parity(x);
        bool parity = false;
        for (int i = 0; i < 64; ++i) {
            parity = parity != get_bit(&x, i);
            CHECK(get_bit(&y, i) == parity);
        }
    }
}

TEST_CASE("operators: crossover equals the referee bit for bit, and mixes the parents' bits place by place") {
    Random setup(10);
    for (const Genome& g : genomes())
        for (int repeat = 0; repeat < 100; ++repeat) {
            const std::vector<Word> mother = random_words(setup, g.words()), father = random_words(setup, g.words());
            std::vector<Word> child1(mother.size()), child2(mother.size());
            Random fast(setup.word()), slow = fast;
            crossover(fast, g.starts(), g.words(), mother.data(), father.data(), child1.data(), child2.data());
            reference::Bits bits1, bits2;
            reference::crossover(slow, g.fields(), reference::unpack(mother.data(), g.bits()),
                                 reference::unpack(father.data(), g.bits()), bits1, bits2);
            CHECK(reference::unpack(child1.data(), g.bits()) == bits1);
            CHECK(reference::unpack(child2.data(), g.bits()) == bits2);
            CHECK(fast.word() == slow.word());
            for (std::size_t w = 0; w < mother.size(); ++w) {
                CHECK((mother[w] ^ father[w]) == (child1[w] ^ child2[w]));
                CHECK((mother[w] & father[w]) == (child1[w] & child2[w]));
            }
        }
}

TEST_CASE("operators: a cut inside a field with probability 1/4, and a field starts from either parent") {
    constexpr int repeats = 20000;
    const Genome g(SearchRanges{}, Code::binary, Scale::linear);
    const std::vector<Word> zeros(4, 0), ones(4, ~Word{0});
    std::vector<Word> a(4), b(4);
    std::vector<int> cuts(194, 0), from_father(194, 0);
    Random r(12);
    for (int repeat = 0; repeat < repeats; ++repeat) {
        crossover(r, g.starts(), 4, zeros.data(), ones.data(), a.data(), b.data());
        bool before = false;
        for (int i = 0; i < 194; ++i) {
            const bool now = get_bit(a.data(), i);
            cuts[static_cast<std::size_t>(i)] += now != before ? 1 : 0;
            from_father[static_cast<std::size_t>(i)] += now ? 1 : 0;
            before = now;
        }
    }
    const auto near = [&](int count, double p) { CHECK_NEAR(count, repeats * p, 5.0 * std::sqrt(repeats * p * (1.0 - p))); };
    for (int i = 0; i < 194; ++i) {
        near(cuts[static_cast<std::size_t>(i)], get_bit(g.starts(), i) ? 0.5 : 0.25);
        near(from_father[static_cast<std::size_t>(i)], 0.5);
    }
}

TEST_CASE("operators: mutation equals the referee bit for bit, over whole populations and parts of chromosomes") {
    Random setup(13);
    for (const Genome& g : genomes())
        for (const double m : {0.0, 0.0005, 0.01, 0.03, 0.5, 1.0}) {
            Random fast(setup.word()), slow = fast;
            Mutation mutation(m, fast);
            reference::Mutation referee(m, slow);
            for (int i = 0; i < 25; ++i) {
                std::vector<Word> c = random_words(setup, g.words());
                reference::Bits bits = reference::unpack(c.data(), g.bits());
                const int first = setup.below(2) == 0 ? 0 : 2 * g.structure_bits();
                mutation.apply(fast, c.data(), 4, 1, first, g.bits());
                referee.apply(slow, bits, static_cast<std::size_t>(first), bits.size());
                CHECK(reference::unpack(c.data(), g.bits()) == bits);
            }
            CHECK(fast.word() == slow.word());
        }
}

TEST_CASE("operators: mutation flips every bit with the same probability") {
    for (const double m : {0.002, 0.01, 0.1, 0.5, 0.9}) {
        constexpr int repeats = 20000, bits = 194;
        Random r(14);
        Mutation mutation(m, r);
        std::vector<int> flips(bits, 0);
        double total = 0.0, pairs = 0.0;
        for (int repeat = 0; repeat < repeats; ++repeat) {
            Word c[4] = {};
            mutation.apply(r, c, 4, 1, 0, bits);
            total += count_bits(c, 4);
            bool before = false;
            for (int i = 0; i < bits; ++i) {
                const bool now = get_bit(c, i);
                flips[static_cast<std::size_t>(i)] += now ? 1 : 0;
                pairs += now && before ? 1.0 : 0.0;  // independent: neighbours flip together with probability m^2
                before = now;
            }
        }
        const double n = static_cast<double>(repeats) * bits;
        CHECK_NEAR(total, n * m, 5.0 * std::sqrt(n * m * (1.0 - m)));
        CHECK_NEAR(pairs, n * m * m, 8.0 * std::sqrt(n * m * m) + 0.01 * n * m * m);
        for (const int f : flips) CHECK_NEAR(f, repeats * m, 5.5 * std::sqrt(repeats * m * (1.0 - m)));
    }
}

TEST_CASE("operators: mutation with probability 0 changes nothing, with 1 every bit of its part and no other") {
    Random r(15);
    Mutation never(0.0, r), always(1.0, r);
    for (int i = 0; i < 100; ++i) {
        Word c[4] = {};
        never.apply(r, c, 4, 1, 0, 194);
        CHECK(count_bits(c, 4) == 0);
        always.apply(r, c, 4, 1, 4, 194);
        CHECK(count_bits(c, 4) == 190);
        CHECK(c[0] == ~Word{0} >> 4);
        CHECK(c[3] == 0xC000000000000000ULL);
    }
}
