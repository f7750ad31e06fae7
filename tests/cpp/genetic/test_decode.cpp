#include "check.hpp"
#include "gaident/genetic/encode.hpp"
#include "gaident/reference/bits.hpp"

using namespace gaident;

namespace {

// The referee's A and B, gathered in pairs in the order of genetic/decode.hpp.
Factors<double> gathered(const reference::Plant& g) {
    Factors<double> f;
    const std::size_t p = g.A1.size(), q = g.A2.size();
    f.structure = {static_cast<int>(p), static_cast<int>(q)};
    f.gain = g.K;
    const auto pair = [](std::complex<double> a, std::complex<double> b) {
        if (b == std::conj(a) && a.imag() != 0.0) return Pair<double>{2.0 * a.real(), a.real() * a.real() + a.imag() * a.imag()};
        return Pair<double>{a.real() + b.real(), a.real() * b.real()};
    };
    int n = 0;
    for (std::size_t i = 0; i + 1 < p; i += 2) f.pole_pair[n++] = pair(g.A1[i], g.A1[i + 1]);
    for (std::size_t j = 0; j + 1 < q; j += 2) f.pole_pair[n++] = pair(g.A2[j], g.A2[j + 1]);
    if (p % 2 == 1 && q % 2 == 1) f.pole_pair[n++] = pair(g.A1[p - 1], g.A2[q - 1]);
    else if (p % 2 == 1) f.pole = g.A1[p - 1].real();
    else if (q % 2 == 1) f.pole = g.A2[q - 1].real();
    n = 0;
    for (std::size_t j = 0; j + 1 < q; j += 2) f.zero_pair[n++] = pair(g.B2[j], g.B2[j + 1]);
    if (q % 2 == 1) f.zero = g.B2[q - 1].real();
    return f;
}

bool same(const Factors<double>& a, const Factors<double>& b) {
    bool equal = a.structure == b.structure && a.gain == b.gain && a.pole == b.pole && a.zero == b.zero;
    for (int i = 0; i < max_pairs; ++i)
        equal = equal && a.pole_pair[i].e1 == b.pole_pair[i].e1 && a.pole_pair[i].e0 == b.pole_pair[i].e0 &&
                a.zero_pair[i].e1 == b.zero_pair[i].e1 && a.zero_pair[i].e0 == b.zero_pair[i].e0;
    return equal;
}

struct Table {
    SearchRanges ranges;
    Code code;
    Scale roots;
    Genome genome() const { return Genome(ranges, code, roots); }
};

std::vector<Table> tables() {
    SearchRanges paper, fine, seven;
    fine.bits = 16;
    fine.real = {0.5, 800.0};
    fine.imaginary = {2.0, 900.0};
    fine.gain_scale = 40.0;
    seven.p_max = seven.q_max = 7;
    seven.bits = 11;
    seven.real = {-5.0, 50.0};
    return {{paper, Code::binary, Scale::linear},
            {paper, Code::gray, Scale::linear},
            {fine, Code::gray, Scale::logarithmic},
            {seven, Code::binary, Scale::linear},
            {seven, Code::gray, Scale::logarithmic}};
}

}  // namespace

TEST_CASE("decode: equals the referee, exactly, over random chromosomes of every table") {
    Random random(11);
    int seen[8][8] = {}, conjugate = 0, real = 0;
    for (const Table& t : tables()) {
        const Genome g = t.genome();
        for (int i = 0; i < 2000; ++i) {
            Word c[Genome::max_words];
            random.words(c, Genome::max_words);
            const reference::Plant plant = reference::decode(reference::unpack(c, g.bits()), g.fields(), t.code, t.ranges);
            const Factors<double> f = decode(c, g);
            CHECK(same(f, gathered(plant)));
            ++seen[f.structure.p][f.structure.q];
            for (const auto& a : plant.A2) ++(a.imag() != 0.0 ? conjugate : real);
        }
    }
    for (const auto& row : seen)
        for (const int n : row) CHECK(n > 0);
    CHECK(conjugate > 1000 && real > 1000);
}

TEST_CASE("decode: conjugate pairs within a group first, then across, what is left is real") {
    const Genome g(SearchRanges{}, Code::binary, Scale::linear);
    Word c[4] = {};
    // Every imaginary gene has its top bit set: all pairs that can be are conjugate.
    for (const Field& f : g.fields())
        if (f.part == Part::imaginary) set_bit(c, f.first, true);
    const auto complex_poles = [&](int p, int q) {
        g.set_structure(c, p, q);
        const Factors<double> f = decode(c, g);
        std::complex<double> poles[max_plant_order], zeros[max_pairs];
        roots_of(f, poles, zeros);
        int n = 0;
        for (int i = 0; i < f.structure.poles(); ++i) n += poles[i].imag() != 0.0 ? 1 : 0;
        return n;
    };
    for (int p = 0; p <= 3; ++p)
        for (int q = 0; q <= 3; ++q) CHECK(complex_poles(p, q) == (p + q) / 2 * 2);
    // The bit of the second member decides, the first member's own does not.
    g.set_structure(c, 2, 0);
    set_bit(c, g.field(Role::pole1, Part::imaginary, 1).first, false);
    CHECK(decode(c, g).pole_pair[0].e0 == 0.0);
}

TEST_CASE("decode: genes of inactive modules are latent") {
    Random random(12);
    for (const Table& t : tables()) {
        const Genome g = t.genome();
        for (int i = 0; i < 200; ++i) {
            Word c[Genome::max_words], d[Genome::max_words];
            random.words(c, Genome::max_words);
            std::copy(c, c + Genome::max_words, d);
            const Factors<double> f = decode(c, g);
            for (const Field& row : g.fields()) {
                const bool active = row.role == Role::p || row.role == Role::q || row.role == Role::gain ||
                                    row.index < (row.role == Role::pole1 ? f.structure.p : f.structure.q);
                if (!active) set_field(d, row.first, row.width, static_cast<std::uint32_t>(random.word() >> (64 - row.width)));
            }
            CHECK(same(f, decode(d, g)));
        }
    }
}

TEST_CASE("decode: encode and decode give every structure back within half a code step") {
    Random random(13);
    for (const Table& t : tables()) {
        const Genome g = t.genome();
        for (int p = t.ranges.p_min; p <= t.ranges.p_max; ++p)
            for (int q = t.ranges.q_min; q <= t.ranges.q_max; ++q)
                for (int repeat = 0; repeat < 20; ++repeat) {
                    // A random chromosome decoded, and its numbers moved off the code's grid by up to half a step.
                    Word c[Genome::max_words];
                    random.words(c, Genome::max_words);
                    g.set_structure(c, p, q);
                    const reference::Plant on_grid =
                        reference::decode(reference::unpack(c, g.bits()), g.fields(), t.code, t.ranges);
                    const Factors<double> f = gathered(on_grid);
                    Word d[Genome::max_words];
                    random.words(d, Genome::max_words);
                    Word before[Genome::max_words];
                    std::copy(d, d + Genome::max_words, before);
                    encode(f, g, d);
                    const Factors<double> back = decode(d, g);
                    CHECK(back.structure == f.structure);
                    CHECK_NEAR(back.gain, f.gain, 1e-12 * f.gain);
                    std::complex<double> poles[2][max_plant_order], zeros[2][max_pairs];
                    roots_of(f, poles[0], zeros[0]);
                    roots_of(back, poles[1], zeros[1]);
                    const double close = 1e-5 * (t.ranges.real.hi + t.ranges.imaginary.hi);  // a double root in double
                    for (int i = 0; i < p + q; ++i) CHECK(std::abs(poles[0][i] - poles[1][i]) < close);
                    for (int i = 0; i < q; ++i) CHECK(std::abs(zeros[0][i] - zeros[1][i]) < close);
                    // Genes of modules beyond (p, q) keep their bits.
                    for (const Field& row : g.fields()) {
                        if (row.role == Role::p || row.role == Role::q || row.role == Role::gain) continue;
                        if (row.index >= (row.role == Role::pole1 ? p : q))
                            CHECK(get_field(d, row.first, row.width) == get_field(before, row.first, row.width));
                    }
                }
    }
}

TEST_CASE("decode: numbers off the grid come back within half a code step") {
    Random random(14);
    SearchRanges s;
    s.imaginary = {1.0, 250.0};
    const Genome g(s, Code::gray, Scale::linear);
    const double half_real = 0.5 * 60.0 / 1023.0 * (1 + 1e-9), half_imaginary = 0.5 * 249.0 / 1023.0 * (1 + 1e-9);
    const auto real = [&] { return 60.0 * random.uniform(); };
    for (int repeat = 0; repeat < 2000; ++repeat) {
        Factors<double> f;
        f.structure = {static_cast<int>(random.below(4)), static_cast<int>(random.below(4))};
        f.gain = 1e3 * std::pow(20.0, random.uniform());
        const auto pair = [&]() -> Pair<double> {
            if (random.below(2) == 0) return conjugate_pair(real(), 1.0 + 249.0 * random.uniform());
            const double a = real();
            return real_pair(a, a > 30.0 ? a - 20.0 * random.uniform() - 1.0 : a + 20.0 * random.uniform() + 1.0);
        };
        for (int i = 0; i < f.structure.pole_pairs(); ++i) f.pole_pair[i] = pair();
        for (int i = 0; i < f.structure.zero_pairs(); ++i) f.zero_pair[i] = pair();
        f.pole = real();
        f.zero = real();
        Word c[4];
        random.words(c, 4);
        encode(f, g, c);
        const Factors<double> back = decode(c, g);
        CHECK(back.structure == f.structure);
        CHECK_NEAR(std::log(back.gain / f.gain), 0.0, 0.5 * std::log(20.0) / 1023.0 * (1 + 1e-9));
        std::complex<double> poles[2][max_plant_order], zeros[2][max_pairs];
        roots_of(f, poles[0], zeros[0]);
        roots_of(back, poles[1], zeros[1]);
        const auto close = [&](std::complex<double> a, std::complex<double> b) {
            CHECK_NEAR(a.real(), b.real(), half_real);
            CHECK_NEAR(a.imag(), b.imag(), half_imaginary);
        };
        for (int i = 0; i < f.structure.poles(); ++i) close(poles[0][i], poles[1][i]);
        for (int i = 0; i < f.structure.q; ++i) close(zeros[0][i], zeros[1][i]);
    }
}
