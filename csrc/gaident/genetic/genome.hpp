// The bit map, drawn once as a table (Fig. 4 of the paper):
//
//     p | q | K | A11 A12 A13 | A21 B21 | A22 B22 | A23 B23        each A and B: real part, imaginary part
//
// 2 + 2 + 10 + 9 * (10 + 10) = 194 bits.
// More bits, p or q up to 7, other ranges or another code are another table and no new code.
// A field of `width` bits with integer code c in 0..2^width - 1 stands for
//
//     linear       value = lo + (hi - lo) * c / (2^width - 1)
//     logarithmic  value = lo * (hi / lo)^(c / (2^width - 1))
//
// after the code has been read as plain binary or as reflected Gray code.
#pragma once

#include "layout.hpp"
#include "../numeric/wrong_use.hpp"
#include "../plant/ranges.hpp"

#include <span>

namespace gaident {

enum class Role : std::uint8_t { p, q, gain, pole1, pole2, zero2 };  // K, A1i, A2j, B2j
enum class Part : std::uint8_t { whole, real, imaginary };
enum class Scale : std::uint8_t { linear, logarithmic };
enum class Code : std::uint8_t { binary, gray };

struct Field {
    Role role;
    Part part;
    int index;  // i of A1i, j of A2j and B2j, from 0
    int first;  // first bit
    int width;  // bits
    Range range;
    Scale scale;
};

class Genome {
public:
    static constexpr int max_fields = 3 + 2 * 21;
    static constexpr int max_order = 7;  // of p and of q
    static constexpr int max_words = (6 + 16 * 43 + word_bits - 1) / word_bits;

    constexpr Genome(const SearchRanges& s, Code code, Scale roots) : code_(code), ranges_(s) {
        check(s);
        const int structure_bits = s.p_max > 3 || s.q_max > 3 ? 3 : 2;
        const double top = static_cast<double>((1 << structure_bits) - 1);
        add(Role::p, Part::whole, 0, structure_bits, {0.0, top}, Scale::linear);
        add(Role::q, Part::whole, 0, structure_bits, {0.0, top}, Scale::linear);
        add(Role::gain, Part::whole, 0, s.bits, s.gain, Scale::logarithmic);
        const int count = structure_bits == 2 ? 3 : 7;
        for (int i = 0; i < count; ++i) add_complex(Role::pole1, i, roots);
        for (int j = 0; j < count; ++j) {
            add_complex(Role::pole2, j, roots);
            add_complex(Role::zero2, j, roots);
        }
        for (int f = 0; f < field_count_; ++f) set_bit(starts_, fields_[f].first, true);
    }

    constexpr int bits() const { return bits_; }
    constexpr int words() const { return words_for(bits_); }
    constexpr int structure_bits() const { return fields_[0].width; }
    constexpr Code code() const { return code_; }
    constexpr const SearchRanges& ranges() const { return ranges_; }
    constexpr std::span<const Field> fields() const { return {fields_, static_cast<std::size_t>(field_count_)}; }
    // A one at the first bit of every field: where crossover starts afresh.
    constexpr const Word* starts() const { return starts_; }
    Layout layout() const { return {bits_, 2 * structure_bits(), {starts_, static_cast<std::size_t>(words())}}; }

    constexpr const Field& field(Role role, Part part, int index) const { return fields_[slot(role, part, index)]; }

    constexpr std::uint32_t code_of(const Word* c, const Field& f) const { return number_of(get_field(c, f.first, f.width)); }

    double value(const Word* c, const Field& f) const { return value_of(get_field(c, f.first, f.width), f); }

    // Of a field's bits, as they stand in the chromosome.
    double value_of(std::uint32_t raw, const Field& f) const {
        const double t = static_cast<double>(number_of(raw)) / static_cast<double>((1U << f.width) - 1U);
        if (f.scale == Scale::linear) return f.range.lo + (f.range.hi - f.range.lo) * t;
        return f.range.lo * __builtin_exp(t * __builtin_log(f.range.hi / f.range.lo));
    }

    // Nearest code of a value; values outside the range take the nearest end.
    void set_value(Word* c, const Field& f, double value) const {
        const double x = value < f.range.lo ? f.range.lo : (value > f.range.hi ? f.range.hi : value);
        const double span = f.scale == Scale::linear ? f.range.hi - f.range.lo : __builtin_log(f.range.hi / f.range.lo);
        const double t = f.scale == Scale::linear ? (x - f.range.lo) / span : __builtin_log(x / f.range.lo) / span;
        const auto code = static_cast<std::uint32_t>(__builtin_lround(t * static_cast<double>((1U << f.width) - 1U)));
        set_field(c, f.first, f.width, code_ == Code::gray ? to_gray(code) : code);
    }

    // p and q are numbers, not search variables on a scale; codes beyond the allowed range take its ends.
    constexpr int structure(const Word* c, Role role) const {
        const int raw = static_cast<int>(code_of(c, fields_[role == Role::p ? 0 : 1]));
        const int lo = role == Role::p ? ranges_.p_min : ranges_.q_min;
        const int hi = role == Role::p ? ranges_.p_max : ranges_.q_max;
        return raw < lo ? lo : (raw > hi ? hi : raw);
    }

    void set_structure(Word* c, int p, int q) const {
        const auto up = static_cast<std::uint32_t>(p), uq = static_cast<std::uint32_t>(q);
        set_field(c, fields_[0].first, fields_[0].width, code_ == Code::gray ? to_gray(up) : up);
        set_field(c, fields_[1].first, fields_[1].width, code_ == Code::gray ? to_gray(uq) : uq);
    }

    static constexpr std::uint32_t to_gray(std::uint32_t x) { return x ^ (x >> 1); }
    static constexpr std::uint32_t from_gray(std::uint32_t g) {
        for (int s = 1; s < 32; s <<= 1) g ^= g >> s;
        return g;
    }

private:
    constexpr std::uint32_t number_of(std::uint32_t raw) const { return code_ == Code::gray ? from_gray(raw) : raw; }

    static constexpr void check(const SearchRanges& s) {
        for (const Range r : {s.gain, s.real, s.imaginary})
            if (!__builtin_isfinite(r.lo) || !__builtin_isfinite(r.hi))
                wrong_use("SearchRanges: the ends of all ranges must be finite");
        if (!(s.gain.lo > 0.0 && s.gain.hi > s.gain.lo))
            wrong_use("SearchRanges: gain needs 0 < lo < hi (it is coded logarithmically)");
        if (!(s.gain_scale > 0.0)) wrong_use("SearchRanges: gain_scale must be positive");
        if (!(s.real.hi > s.real.lo)) wrong_use("SearchRanges: real needs lo < hi");
        if (!(s.imaginary.lo >= 0.0 && s.imaginary.hi > s.imaginary.lo)) wrong_use("SearchRanges: imaginary needs 0 <= lo < hi");
        if (s.p_min < 0 || s.p_max < s.p_min || s.p_max > max_order) wrong_use("SearchRanges: p needs 0 <= lo <= hi <= 7");
        if (s.q_min < 0 || s.q_max < s.q_min || s.q_max > max_order) wrong_use("SearchRanges: q needs 0 <= lo <= hi <= 7");
        if (s.bits < 2 || s.bits > 16) wrong_use("SearchRanges: bits must be 2..16");
    }

    constexpr void add(Role role, Part part, int index, int width, Range range, Scale scale) {
        fields_[field_count_++] = Field{role, part, index, bits_, width, range, scale};
        bits_ += width;
    }

    // On a logarithmic scale a range that begins at or below 0 is coded over four decades below its upper end; the
    // local fit, which knows no codes, still reaches down to the range's own lower end.
    constexpr void add_complex(Role role, int index, Scale scale) {
        for (const Part part : {Part::real, Part::imaginary}) {
            Range r = part == Part::real ? ranges_.real : ranges_.imaginary;
            if (scale == Scale::logarithmic && r.lo <= 0.0) r.lo = r.hi > 0.0 ? r.hi * 1e-4 : r.lo;
            const Scale s = r.lo > 0.0 ? scale : Scale::linear;
            add(role, part, index, ranges_.bits, r, s);
        }
    }

    constexpr int slot(Role role, Part part, int index) const {
        if (role == Role::p || role == Role::q || role == Role::gain) return static_cast<int>(role);
        const int count = structure_bits() == 2 ? 3 : 7;
        const int number = role == Role::pole1 ? index : count + 2 * index + (role == Role::zero2 ? 1 : 0);
        return 3 + 2 * number + (part == Part::imaginary ? 1 : 0);
    }

    Field fields_[max_fields] = {};
    int field_count_ = 0;
    int bits_ = 0;
    Word starts_[max_words] = {};
    Code code_;
    SearchRanges ranges_;
};

}  // namespace gaident
