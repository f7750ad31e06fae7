#include "check.hpp"
#include "gaident/genetic/population.hpp"
#include "gaident/reference/bits.hpp"

using namespace gaident;

namespace {

Field field_at(int first, int width) { return {Role::gain, Part::whole, 0, first, width, {0.0, 1.0}, Scale::linear}; }

}  // namespace

TEST_CASE("chromosome: bits stand in reading order, most significant first") {
    Word c[2] = {0, 0};
    set_bit(c, 0, true);
    set_bit(c, 64, true);
    set_bit(c, 67, true);
    CHECK(c[0] == 0x8000000000000000ULL);
    CHECK(c[1] == 0x9000000000000000ULL);
    CHECK(get_bit(c, 67) && !get_bit(c, 66));
    set_bit(c, 0, false);
    CHECK(c[0] == 0);
    CHECK(words_for(1) == 1 && words_for(64) == 1 && words_for(65) == 2 && words_for(194) == 4);
}

TEST_CASE("chromosome: every field of every width, also over a word's edge, equals the referee's") {
    Random random(1);
    for (int width = 1; width <= 32; ++width)
        for (int first = 0; first + width <= 192; ++first) {
            Word c[3];
            random.words(c, 3);
            reference::Bits bits = reference::unpack(c, 192);
            const Field f = field_at(first, width);
            CHECK(get_field(c, first, width) == reference::get(bits, f));
            const auto code = static_cast<std::uint32_t>(random.word() >> (64 - width));
            set_field(c, first, width, code);
            reference::set(bits, f, code);
            CHECK(get_field(c, first, width) == code);
            CHECK(reference::pack(bits) == std::vector<Word>(c, c + 3));  // and nothing beside the field has changed
        }
}

TEST_CASE("chromosome: count of ones") {
    Random random(2);
    for (int n = 1; n < 6; ++n) {
        Word c[6];
        random.words(c, 6);
        int ones = 0;
        for (const bool b : reference::unpack(c, 64 * n)) ones += b ? 1 : 0;
        CHECK(count_bits(c, n) == ones);
    }
}

TEST_CASE("chromosome: a population is one flat array of chromosomes") {
    Population a(5, 4), b(5, 4);
    CHECK(a.size() == 5 && a.words() == 4 && a.flat().size() == 20);
    for (const Word w : a.flat()) CHECK(w == 0);
    a[3][1] = 7;
    CHECK(a.flat()[13] == 7);
    a.swap(b);
    CHECK(b[3][1] == 7 && a[3][1] == 0);
    CHECK_THROWS(Population(0, 4), std::invalid_argument);
    CHECK_THROWS(Population(5, 0), std::invalid_argument);
}
