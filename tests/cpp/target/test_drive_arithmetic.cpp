// The arithmetics of a drive: the DSP's float, fixed point, and the one that counts.
#include "check.hpp"
#include "gaident/numeric/c30.hpp"
#include "gaident/target/candidate.hpp"
#include "gaident/numeric/counting.hpp"
#include "gaident/target/fixed_scaling.hpp"
#include "gaident/reference/drives.hpp"

using namespace gaident;

namespace {

double number(const C30& x) { return static_cast<double>(x); }
double number(const FixedNumber& x) { return static_cast<double>(x); }

// Numbers of many sizes and both signs.
double any(Random& random) {
    const double size = reference::log_uniform(random, 1e-6, 1e6);
    return random.below(2) == 0 ? size : -size;
}

// Largest errors of R's operations, relative to the larger operand (sums) and to the result; comparison must be exact.
template <class R>
void operations_are_within(double sum, double product, double quotient) {
    Random random(5);
    double worst_sum = 0.0, worst_product = 0.0, worst_quotient = 0.0;
    for (int i = 0; i < 20000; ++i) {
        const R a(any(random)), b(i % 3 == 0 ? -1.000001 * number(a) : any(random));
        const double x = number(a), y = number(b), larger = std::max(std::abs(x), std::abs(y));
        worst_sum = std::max({worst_sum, std::abs(number(a + b) - (x + y)) / larger, std::abs(number(a - b) - (x - y)) / larger});
        worst_product = std::max(worst_product, std::abs(number(a * b) / (x * y) - 1.0));
        worst_quotient = std::max(worst_quotient, std::abs(number(a / b) / (x / y) - 1.0));
        CHECK((a < b) == (x < y) && (b < a) == (y < x) && !(a < a));
        CHECK(number(-(-a)) == x);
    }
    std::printf("sum %.3g of %.3g, product %.3g of %.3g, quotient %.3g of %.3g\n", worst_sum, sum, worst_product, product,
                worst_quotient, quotient);
    CHECK(worst_sum <= sum && worst_product <= product && worst_quotient <= quotient);
    CHECK(worst_sum > 0.4 * sum);  // and no better than the format
}

}  // namespace

// ------------------------------------------------------------------------------------------------------------------- TMS320C30

TEST_CASE("c30: known patterns, both ways") {
    const struct {
        double value;
        std::uint32_t bits;
    } known[] = {{1.0, 0x00000000},
                 {-1.0, 0xFF800000},
                 {0.0, 0x80000000},
                 {0.5, 0xFF000000},
                 {-2.0, 0x00800000},
                 {1.5, 0x00400000},
                 {-1.5, 0x00C00000},
                 {43.6, 0x052E6666},
                 // the ends of the format (user's guide, section 5.3.3)
                 {(2.0 - 0x1p-23) * 0x1p127, 0x7F7FFFFF},
                 {0x1p-127, 0x81000000},
                 {(-1.0 - 0x1p-23) * 0x1p-127, 0x81FFFFFF},
                 {-0x1p128, 0x7F800000}};
    for (const auto& k : known) {
        CHECK(C30Word(k.value).bits == k.bits);
        if (k.value != 43.6) CHECK(static_cast<double>(C30Word::of_bits(k.bits)) == k.value);
    }
    CHECK_NEAR(static_cast<double>(C30Word(43.6)), 43.6, 43.6 * 0x1p-24);
    Random random(1);
    for (int i = 0; i < 1000; ++i) {
        const C30Word w = C30Word::of_bits(static_cast<std::uint32_t>(random.word()));
        if (w.bits >> 24 == 0x80) continue;  // zero has one pattern only
        CHECK(C30Word(static_cast<double>(w)) == w && C30Word(C30(w)) == w);
    }
}

TEST_CASE("c30: sums of 32 bits, products of 24 by 24 into 32, all cut towards minus infinity") {
    operations_are_within<C30>(0x1p-31, 0x1p-31, 0x1p-22);
    const C30 one(1.0), two(2.0), tiny(0x1p-40);
    CHECK(number(one + tiny) == 1.0 && number(one - tiny) == 1.0);          // the smaller operand falls out ...
    CHECK(number(one + -tiny) == 1.0 - 0x1p-31);                            // ... and cut towards minus infinity leaves -1 there
    CHECK(number((one + C30(0x1p-30)) * two) == 2.0);                       // a product cuts its operands to words
    CHECK(number(C30(C30Word(one + C30(0x1p-30)))) == 1.0);                 // so does a store
    CHECK(number(C30(-1.5) * C30(1.0 + 0x1p-23)) == -1.5 - 1.5 * 0x1p-23);  // 48 bits of product, here exact
    // The user's guide's examples 5-8 and 5-15: -2 * -2, and a sum normalised by 32 places.
    CHECK(C30Word(C30(-2.0) * C30(-2.0)).bits == C30Word(4.0).bits);
    CHECK(number(C30::normal((std::int64_t{1} << 32) - 1, 127) + C30::normal(-(std::int64_t{1} << 32), 127)) == -0x1p96);
}

TEST_CASE("c30: beyond the range the largest of the sign, below it zero") {
    const C30 large(3e38), small(1e-30);
    CHECK(C30Word(large * large).bits == 0x7F7FFFFF && C30Word(large * -large).bits == 0x7F800000);
    CHECK(C30Word(large + large).bits == 0x7F7FFFFF && C30Word(-large - large).bits == 0x7F800000);
    CHECK(C30Word(small * small).bits == 0x80000000 && C30Word(1e-300).bits == 0x80000000);
    CHECK(C30Word(1e300).bits == 0x7F7FFFFF && C30Word(-1e300).bits == 0x7F800000);
    CHECK(number(C30(0.0) * large) == 0.0 && number(C30(0.0) + small) == number(small) && number(large - large) == 0.0);
}

// ------------------------------------------------------------------------------------------------------------------ fixed point

TEST_CASE("fixed: numbers keep 30 bits, rounded to nearest, halves up") {
    operations_are_within<FixedNumber>(0x1p-30, 0x1p-31, 0x1p-30);
    CHECK(detail::shifted_down(5, 1) == 3 && detail::shifted_down(-5, 1) == -2 && detail::shifted_down(-6, 2) == -1);
    CHECK(detail::shifted_down(7, 0) == 7 && detail::shifted_down(1LL << 61, 63) == 0);
    CHECK(FixedNumber(1.0).word == 1 << 30 && FixedNumber(1.0).point == 30);
    CHECK(FixedNumber(2.0 - 0x1p-40).word == 1 << 30 && FixedNumber(2.0 - 0x1p-40).point == 29);  // rounds up into the next size
    CHECK(number(FixedNumber(-0.75) * FixedNumber(4.0)) == -3.0 && number(FixedNumber(0.0) / FixedNumber(3.0)) == 0.0);
    CHECK(number(FixedNumber(1.0) / FixedNumber(0.0)) > 1e200 && number(FixedNumber(-1.0) / FixedNumber(0.0)) < -1e200);
}

TEST_CASE("fixed: a signal rounds once, and what it cannot hold takes the end and says so") {
    const FixedSignal x = FixedSignal::of(1.25, 4);  // in sixteenths
    CHECK(x.word == 20 && !x.saturated && static_cast<double>(x) == 1.25);
    CHECK(FixedSignal::of(1.28125, 4).word == 21 && FixedSignal::of(-1.28125, 4).word == -20);  // half a sixteenth: up
    // x + a y, a y = 1/48: 0.333 of a sixteenth each, which only the sum sees
    const FixedProduct third = FixedNumber(1.0 / 48.0) * FixedSignal::of(1.0, 4);
    CHECK(FixedSignal(x + third).word == 20 && FixedSignal(x + third + third).word == 21 &&
          FixedSignal(x - third - third).word == 19);
    const FixedSignal y = FixedSignal::of(3.0, 8);  // another point: the sum takes that of its left
    CHECK(FixedSignal(x + y).word == 68 && FixedSignal(x + y).point == 4 && FixedSignal(y + x).point == 8);

    const FixedSignal large = FixedSignal::of(1e8, 4);
    CHECK(!large.saturated && FixedSignal::of(1e9, 4).saturated && FixedSignal::of(1e9, 4).word == 2147483647);
    CHECK(FixedSignal::of(-1e30, 4).word == -2147483647 - 1 && FixedSignal::of(1e-30, 4).word == 0);
    const FixedSignal sum = large + large;
    CHECK(sum.saturated && sum.word == 2147483647);
    const FixedSignal low = FixedSignal::of(-1e8, 4) - large;
    CHECK(low.saturated && low.word == -2147483647 - 1);
    CHECK((low - x).saturated && FixedSignal(x + low).saturated && (x * low).saturated);  // it is never forgotten
    const FixedProduct huge = FixedNumber(1e30) * large;
    CHECK(FixedSignal(x + huge).saturated && FixedSignal(x - huge).saturated);
    FixedErrorSum errors;
    CHECK(!(errors + large * large).saturated && (errors + low * low).saturated);
}

TEST_CASE("fixed: scalings come from the ranges; wider ranges leave fewer bits, headroom costs its bits") {
    const SearchRanges ranges;
    const reference::Drive d = reference::paper_drive(true);
    const auto scaling = [&](const SearchRanges& r, double peak, int headroom) {
        return FixedScaling(Extent{peak, 250, &r, d.loop.controller, Clock{d.sample_time}}, headroom);
    };
    const FixedScaling s = scaling(ranges, 43.6, 0);
    CHECK(s.signal_point == 25);  // 43.6 < 64 = 2^6, and 31 bits
    CHECK(scaling(ranges, 43.6, 3).signal_point == 22 && scaling(ranges, 90.0, 0).signal_point == 24);
    for (int i = 0; i < 4; ++i) {
        CHECK(scaling(ranges, 43.6, 3).states[1][2].at[i] == s.states[1][2].at[i] - 3);
        SearchRanges wide = ranges;
        wide.gain.hi *= 100.0;
        wide.imaginary.hi *= 4.0;
        CHECK(scaling(wide, 43.6, 0).states[1][2].at[i] <= s.states[1][2].at[i]);
    }
    CHECK(s.states[1][2].at[3] > s.states[1][2].at[1]);  // later states are smaller
}

// --------------------------------------------------------------------------------------------------------------------- counting

namespace {

// What one sample takes in delta form at order n, squared error included.
template <bool driven>
Operations sample(int n) {
    using A = Plain<CountedWord, Counted>;
    Delta<CountedWord> h;
    h.order = n;
    CountedWord x[max_loop_order], in[1], out[1];
    operations = {};
    squared_errors<A, -1, driven>(h, x, in, out, 1, {}, [](const Counted&) {});
    return operations;
}

}  // namespace

TEST_CASE("counting: the delta form's operations per sample, from which docs/dsp.md takes its cycle budget") {
    for (int n = 1; n <= 7; ++n) {
        const Operations with = sample<true>(n), without = sample<false>(n);
        CHECK(with.multiplies == 2 * n + 2 && with.adds == 3 * n + 2 && with.stores == n && with.divides == 0);
        CHECK(without.multiplies == n + 1 && without.adds == 2 * n + 1 && without.stores == n && without.divides == 0);
        CHECK(with.loads == 4 * n + 3 && without.loads == 3 * n + 1);
        std::printf("order %d: %ld multiplications, %ld additions, %ld loads, %ld stores; settling %ld, %ld, %ld, %ld\n", n,
                    with.multiplies, with.adds, with.loads, with.stores, without.multiplies, without.adds, without.loads,
                    without.stores);
    }
}

TEST_CASE("counting: the cascade of factor modules and the coefficients, per structure") {
    // The referee's cascade as it is written; a drive would know its divisors before the run, so a division counts as a product.
    const struct {
        std::size_t p, q;
        Operations cascade, coefficients;
    } kept[] = {
        {1, 0, {22, 23, 9, 0, 0}, {23, 8, 2, 0, 0}},
        {1, 2, {44, 39, 19, 0, 0}, {74, 32, 3, 0, 0}},
        {3, 3, {66, 55, 29, 0, 0}, {199, 96, 4, 0, 0}},
    };
    Random random(3);
    for (const auto& k : kept) {
        const auto d = reference::random_drive(random, LoopKind::continuous, k.p, k.q, reference::Family::ordinary, 2);
        const auto system = reference::factor_modules<Counted>(d.plant);
        const auto count = [&](std::size_t samples) {
            operations = {};
            reference::run_continuous(system, std::vector<double>(samples, 1.0), d.sample_time, d.loop);
            return operations;
        };
        const Operations one = count(1), two = count(2);
        const Operations c{two.multiplies - one.multiplies, two.adds - one.adds, two.divides - one.divides, 0, 0};
        Factors<CountedWord> f;
        f.structure = {static_cast<int>(k.p), static_cast<int>(k.q)};
        operations = {};
        close_loop(bilinear_plant(f, 1e-3), Controller{.kp = 1.0, .ki = 1.0}, Clock{1e-3});
        const Operations made{operations.multiplies, operations.adds, operations.divides, 0, 0};
        std::printf("(%zu,%zu): cascade {%ld, %ld, %ld}, coefficients {%ld, %ld, %ld}\n", k.p, k.q, c.multiplies, c.adds,
                    c.divides, made.multiplies, made.adds, made.divides);
        CHECK(c == k.cascade && made == k.coefficients);
    }
}
