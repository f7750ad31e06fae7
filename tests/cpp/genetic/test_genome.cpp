#include "check.hpp"
#include "gaident/reference/bits.hpp"

#include <algorithm>

using namespace gaident;

namespace {

SearchRanges large(int bits) {
    SearchRanges s;
    s.p_max = s.q_max = 7;
    s.bits = bits;
    return s;
}

}  // namespace

TEST_CASE("genome: 194 bits in the order of Fig. 4") {
    const Genome g(SearchRanges{}, Code::binary, Scale::linear);
    CHECK(g.bits() == 194);
    CHECK(g.words() == 4);
    CHECK(g.fields().size() == 21);
    struct Row {
        Role role;
        int index;
    };
    const Row order[] = {{Role::pole1, 0}, {Role::pole1, 1}, {Role::pole1, 2}, {Role::pole2, 0}, {Role::zero2, 0},
                         {Role::pole2, 1}, {Role::zero2, 1}, {Role::pole2, 2}, {Role::zero2, 2}};
    const auto is = [&](std::size_t i, Role role, Part part, int index, int first, int width) {
        const Field& f = g.fields()[i];
        CHECK(f.role == role && f.part == part && f.index == index && f.first == first && f.width == width);
        CHECK(&g.field(role, part, index) == &f);
    };
    is(0, Role::p, Part::whole, 0, 0, 2);
    is(1, Role::q, Part::whole, 0, 2, 2);
    is(2, Role::gain, Part::whole, 0, 4, 10);
    for (std::size_t k = 0; k < 9; ++k) {
        const int first = 14 + 20 * static_cast<int>(k);
        is(3 + 2 * k, order[k].role, Part::real, order[k].index, first, 10);
        is(4 + 2 * k, order[k].role, Part::imaginary, order[k].index, first + 10, 10);
    }
}

TEST_CASE("genome: other tables have no gaps, and their starts mark every field") {
    for (const int bits : {2, 7, 10, 16})
        for (const bool seven : {false, true}) {
            SearchRanges s = seven ? large(bits) : SearchRanges{};
            s.bits = bits;
            const Genome g(s, Code::gray, Scale::logarithmic);
            CHECK(g.bits() == (seven ? 6 + 43 * bits : 4 + 19 * bits));
            CHECK(g.words() <= Genome::max_words);
            int next = 0;
            for (const Field& f : g.fields()) {
                CHECK(f.first == next);
                next += f.width;
                CHECK(&g.field(f.role, f.part, f.index) == &f);
            }
            CHECK(next == g.bits());
            for (int i = 0; i < g.bits(); ++i) {
                bool begins = false;
                for (const Field& f : g.fields()) begins = begins || f.first == i;
                CHECK(get_bit(g.starts(), i) == begins);
            }
            CHECK(count_bits(g.starts(), g.words()) == static_cast<int>(g.fields().size()));
        }
}

TEST_CASE("genome: Gray code and back, neighbours one bit apart") {
    for (std::uint32_t x = 0; x < 1U << 16; ++x) {
        const std::uint32_t gray = Genome::to_gray(x);
        CHECK(Genome::from_gray(gray) == x);
        CHECK(reference::from_gray(gray, 16) == x);
        CHECK(x == 0 || std::popcount(gray ^ Genome::to_gray(x - 1)) == 1);
    }
    for (const std::uint32_t x : {0xFFFFFFFFU, 0x80000000U, 0xDEADBEEFU}) CHECK(Genome::from_gray(Genome::to_gray(x)) == x);
}

TEST_CASE("genome: value and set_value, every code of every field, both codes and scales") {
    for (const Code code : {Code::binary, Code::gray})
        for (const Scale roots : {Scale::linear, Scale::logarithmic}) {
            SearchRanges s;
            s.real = {0.5, 60.0};
            s.imaginary = {3.0, 250.0};
            const Genome g(s, code, roots);
            Word c[Genome::max_words] = {};
            for (const Field& f : g.fields()) {
                const std::uint32_t top = (1U << f.width) - 1;
                double before = 0.0;
                for (std::uint32_t k = 0; k <= top; ++k) {
                    set_field(c, f.first, f.width, code == Code::gray ? Genome::to_gray(k) : k);
                    const double v = g.value(c, f);
                    CHECK(g.code_of(c, f) == k);
                    CHECK(v == reference::value(reference::unpack(c, g.bits()), f, code));
                    CHECK(k == 0 || v > before);
                    CHECK(v >= f.range.lo * (1 - 1e-14) && v <= f.range.hi * (1 + 1e-14));
                    before = v;
                    set_field(c, f.first, f.width, 0);
                    g.set_value(c, f, v);
                    CHECK(g.code_of(c, f) == k);
                }
                g.set_value(c, f, f.range.lo - 1.0);
                CHECK(g.code_of(c, f) == 0);
                g.set_value(c, f, f.range.hi + 1.0);
                CHECK(g.code_of(c, f) == top);
            }
        }
}

TEST_CASE("genome: linear and logarithmic scale in figures") {
    SearchRanges s;
    s.bits = 2;  // codes 0..3
    s.gain = {1.0, 1000.0};
    s.real = {-10.0, 20.0};
    s.imaginary = {1.0, 8.0};
    const Genome g(s, Code::binary, Scale::logarithmic);
    Word c[Genome::max_words] = {};
    const double gain[] = {1.0, 10.0, 100.0, 1000.0}, imaginary[] = {1.0, 2.0, 4.0, 8.0};
    for (std::uint32_t k = 0; k < 4; ++k) {
        const auto at = [&](const Field& f) {
            set_field(c, f.first, f.width, k);
            return g.value(c, f);
        };
        CHECK_NEAR(at(g.field(Role::gain, Part::whole, 0)), gain[k], 1e-12 * gain[k]);
        CHECK_NEAR(at(g.field(Role::zero2, Part::imaginary, 2)), imaginary[k], 1e-12 * imaginary[k]);
        // Four decades below the upper end where the range itself has no logarithm.
        const double real[] = {20e-4, 20e-4 * 21.544346900318832, 20.0 / 21.544346900318832, 20.0};
        CHECK_NEAR(at(g.field(Role::pole1, Part::real, 0)), real[k], 1e-12 * real[k]);
    }
    // A range all on the left of the origin stays linear.
    s.real = {-30.0, -10.0};
    const Genome left(s, Code::binary, Scale::logarithmic);
    CHECK(left.field(Role::pole1, Part::real, 0).scale == Scale::linear);
}

TEST_CASE("genome: p and q are numbers, kept inside their range") {
    for (const Code code : {Code::binary, Code::gray}) {
        SearchRanges s = large(10);
        s.p_min = 1;
        s.p_max = 5;
        s.q_min = 2;
        const Genome g(s, code, Scale::linear);
        CHECK(g.structure_bits() == 3);
        Word c[Genome::max_words] = {};
        for (int p = 0; p <= 7; ++p)
            for (int q = 0; q <= 7; ++q) {
                g.set_structure(c, p, q);
                CHECK(g.structure(c, Role::p) == std::clamp(p, 1, 5));
                CHECK(g.structure(c, Role::q) == std::clamp(q, 2, 7));
                CHECK(count_bits(c, g.words()) <= 6);
            }
    }
}

TEST_CASE("genome: the unit of the gain") {
    SearchRanges s;
    CHECK(s.gain_unit(0) == 1.0 && s.gain_unit(3) == 1.0);
    s.gain_scale = 50.0;
    CHECK_NEAR(s.gain_unit(0), 0.02, 1e-17);
    CHECK(s.gain_unit(1) == 1.0 && s.gain_unit(2) == 50.0 && s.gain_unit(3) == 2500.0);
    CHECK(s.gain_limits(1).lo == s.gain.lo && s.gain_limits(1).hi == s.gain.hi);
    CHECK_NEAR(s.gain_limits(2).hi, s.gain.hi * 50e3, 1e-6);
}

TEST_CASE("genome: ranges without sense are refused") {
    const auto refused = [](auto&& change) {
        SearchRanges s;
        change(s);
        CHECK_THROWS(Genome(s, Code::binary, Scale::linear), std::invalid_argument);
    };
    const double nan = std::nan("");
    refused([](auto& s) { s.gain = {0.0, 1.0}; });
    refused([](auto& s) { s.gain = {2.0, 2.0}; });
    refused([&](auto& s) { s.gain = {1.0, nan}; });
    refused([](auto& s) { s.gain_scale = 0.0; });
    refused([](auto& s) { s.real = {1.0, 1.0}; });
    refused([&](auto& s) { s.real = {nan, 1.0}; });
    refused([](auto& s) { s.imaginary = {-1.0, 1.0}; });
    refused([](auto& s) { s.imaginary = {2.0, 1.0}; });
    refused([](auto& s) { s.p_max = 8; });
    refused([](auto& s) { s.q_min = 4; });
    refused([](auto& s) { s.p_min = -1; });
    refused([](auto& s) { s.bits = 1; });
    refused([](auto& s) { s.bits = 17; });
}
