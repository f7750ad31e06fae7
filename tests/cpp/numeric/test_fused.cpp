// One rounding instead of two: what it is, that every instruction set has it, and what it is worth.
#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/numeric/denormals.hpp"
#include "gaident/numeric/elementary.hpp"

#include <bit>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace gaident {  // where fma is these

namespace {

// A double whose products and sums are rounded twice, as the recurrences had them; and a wider number, to measure both with.
template <class T, bool fuses>
struct Number {
    T v{};
    Number() = default;
    explicit Number(double x) : v(static_cast<T>(x)) {}
    static Number of(T x) {
        Number r;
        r.v = x;
        return r;
    }
    explicit operator double() const { return static_cast<double>(v); }
    friend Number operator+(Number a, Number b) { return of(a.v + b.v); }
    friend Number operator-(Number a, Number b) { return of(a.v - b.v); }
    friend Number operator*(Number a, Number b) { return of(a.v * b.v); }
    friend Number operator/(Number a, Number b) { return of(a.v / b.v); }
    friend Number operator-(Number a) { return of(-a.v); }
    friend Number fma(Number a, Number b, Number c) {
        if constexpr (fuses) return of(gaident::fma(a.v, b.v, c.v));
        else return of(a.v * b.v + c.v);
    }
    friend Number fnma(Number a, Number b, Number c) {
        if constexpr (fuses) return of(gaident::fnma(a.v, b.v, c.v));
        else return of(c.v - a.v * b.v);
    }
    friend Number clamp(Number x, Number lo, Number hi) { return x.v < lo.v ? lo : (x.v > hi.v ? hi : x); }
};
using Once = Number<double, true>;
using Twice = Number<double, false>;
using Wide = Number<long double, false>;
static_assert(Arithmetic<Once> && Arithmetic<Wide>);

struct Baseline {
    static constexpr int register_bytes = 16;
};

#if defined(__x86_64__)
// The processor's instruction itself, whatever the C library takes for its function.
__attribute__((target("fma"))) double instruction(double a, double b, double c) {
    return _mm_cvtsd_f64(_mm_fmadd_sd(_mm_set_sd(a), _mm_set_sd(b), _mm_set_sd(c)));
}

// Zeros with their signs; a NaN is a NaN.
bool same_bits(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (a != a && b != b);
}
#endif

// max |y - x| / max |x|, y(n) of the same equation in R and x in the wide number.
template <class R>
long double error(const Delta<double>& h, const std::vector<double>& input) {
    R a[max_loop_order], b[max_loop_order + 1], x[max_loop_order] = {};
    Wide wa[max_loop_order], wb[max_loop_order + 1], wx[max_loop_order] = {};
    for (int i = 0; i < h.order; ++i) {
        a[i] = R(h.a[i]);
        wa[i] = Wide(h.a[i]);
    }
    for (int i = 0; i <= h.order; ++i) {
        b[i] = R(h.b[i]);
        wb[i] = Wide(h.b[i]);
    }
    long double difference = 0.0L, size = 0.0L;
    for (const double u : input) {
        const auto y = static_cast<long double>(recurrence_step<R, -1>(h.order, a, b, x, R(u)).v);
        const long double exact = recurrence_step<Wide, -1>(h.order, wa, wb, wx, Wide(u)).v;
        difference = std::max(difference, std::abs(y - exact));
        size = std::max(size, std::abs(exact));
    }
    return difference / size;
}

}  // namespace

TEST_CASE("fused: the product is not rounded") {
    const double e = 0x1p-30;
    volatile double a = 1.0 + e, b = 1.0 - e;  // a b = 1 - 2^-60
    CHECK(fma(a, b, -1.0) == -0x1p-60);
    CHECK(fnma(a, b, 1.0) == 0x1p-60);
    volatile float c = 1.0F + 0x1p-13F, d = 1.0F - 0x1p-13F;
    CHECK(fma(c, d, -1.0F) == -0x1p-26F);
    CHECK(fnma(c, d, 1.0F) == 0x1p-26F);
    CHECK(a * b + -1.0 == 0.0);  // the compiler fuses nothing by itself
}

TEST_CASE("fused: lanes, and one candidate in the code of an instruction set, give the bits of the number") {
    Random random(7);
    using L = Lanes<double, 8, Baseline>;
    using F = Lanes<float, 8, Baseline>;
    using S = Single<double, Baseline>;
    for (int repeat = 0; repeat < 1000; ++repeat) {
        double n[3][8], out[2][8];
        float f[3][8], out_f[8];
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < 8; ++i) {
                n[k][i] = std::ldexp(random.uniform() - 0.5, static_cast<int>(random.below(60)) - 30);
                f[k][i] = static_cast<float>(n[k][i]);
            }
        fma(L::load(n[0]), L::load(n[1]), L::load(n[2])).store(out[0]);
        fnma(L::load(n[0]), L::load(n[1]), L::load(n[2])).store(out[1]);
        fma(F::load(f[0]), F::load(f[1]), F::load(f[2])).store(out_f);
        for (int i = 0; i < 8; ++i) {
            CHECK(out[0][i] == fma(n[0][i], n[1][i], n[2][i]));
            CHECK(out[1][i] == fnma(n[0][i], n[1][i], n[2][i]));
            CHECK(out_f[i] == fma(f[0][i], f[1][i], f[2][i]));
            CHECK(fma(S(n[0][i]), S(n[1][i]), S(n[2][i])).v == out[0][i]);
            CHECK(fnma(S(n[0][i]), S(n[1][i]), S(n[2][i])).v == out[1][i]);
        }
    }
}

#if defined(__x86_64__)
// The build runs this a second time with the C library's function without the instruction (fused_without_instruction).
TEST_CASE("fused: near the smallest numbers, denormals flushed or not, the bits are the instruction's") {
    if (__builtin_cpu_supports("fma") == 0) return;  // nothing to compare with
    using L = Lanes<double, 8, Baseline>;
    Random random(23);
    const auto number = [&](int exponent) {
        return std::ldexp((random.below(2) == 0 ? 1.0 : -1.0) * (1.0 + random.uniform()), exponent);
    };
    const double least = 0x1p-1022;
    for (const bool flushed : {true, false}) {
        int compared = 0, wrong = 0, zeros = 0;
        const auto compare = [&](double a, double b, double c) {
            volatile double in[] = {a, b, c};
            volatile double plus, minus, exact_plus, exact_minus, in_lanes;  // volatile: computed where denormals are flushed
            const auto compute = [&] {
                double lanes[8];
                plus = fma(in[0], in[1], in[2]);
                minus = fnma(in[0], in[1], in[2]);
                fma(L::all(in[0]), L::all(in[1]), L::all(in[2])).store(lanes);
                in_lanes = lanes[7];
                exact_plus = instruction(in[0], in[1], in[2]);
                exact_minus = instruction(-in[0], in[1], in[2]);
            };
            if (flushed) {
                const FlushDenormals flush;
                compute();
            } else compute();
            ++compared;
            if (exact_plus == 0.0) ++zeros;
            if (!same_bits(plus, exact_plus) || !same_bits(minus, exact_minus) || !same_bits(in_lanes, exact_plus)) ++wrong;
        };
        for (int repeat = 0; repeat < 200000; ++repeat) {
            // the product's and the sum's exponents up to 60 apart, from beyond the smallest denormal to 1e-280
            const int of_sum = -1080 + static_cast<int>(random.below(150)), of_a = -1040 + static_cast<int>(random.below(1080));
            const int of_b = std::clamp(of_sum + static_cast<int>(random.below(120)) - 60 - of_a, -1074, 1000);
            const double a = number(of_a), b = number(of_b), c = number(of_sum);
            compare(a, b, c);
            if (repeat % 8 == 0) compare(a, b, -a * b);  // what is left is the product's rounding
            if (repeat % 8 == 1) compare(a, b, 0.0);
        }
        // around half a unit of 53 bits, and of a denormal, below the smallest normal number
        for (const double sign : {1.0, -1.0})
            for (int k = 1; k <= 64; ++k)
                for (const int e : {-100, -540, -900}) {
                    compare(std::ldexp(-sign * k, -1080 - e), std::ldexp(1.0, e), sign * least);
                    compare(sign * (1.0 - k * 0x1p-53), least, 0.0);
                }
        const double kept[] = {0.0, -0.0, HUGE_VAL, -HUGE_VAL, NAN, least, 0x1p-1074, 1.0, -0x1.fffffffffffffp+1023};
        for (const double a : kept)
            for (const double b : kept)
                for (const double c : kept) compare(a, b, c);
        std::printf("denormals %s: %d of %d differ; %d are zero\n", flushed ? "flushed" : "kept", wrong, compared, zeros);
        CHECK(wrong == 0);
        CHECK(zeros > 1000);
    }
}
#endif

// The same coefficients and equation in double and in 64 bits of fraction: what is left is rounding.
TEST_CASE("fused: the recurrence is at least as exact as with two roundings") {
    for (const LoopKind kind : {LoopKind::continuous, LoopKind::sampled}) {
        Random random(19);
        std::vector<double> ratio;
        double once = 0.0, twice = 0.0;
        for (const auto family : reference::families)
            for (std::size_t p = 1; p <= 3; ++p)
                for (std::size_t q = 0; q <= 3; ++q)
                    for (int repeat = 0; repeat < 12; ++repeat) {
                        const auto d = reference::random_drive(random, kind, p, q, family, 250);
                        const Delta<double> h =
                            close_loop(plant_of(d.factors(), d.loop, d.sample_time), d.loop.controller, Clock{d.sample_time});
                        const auto fused = static_cast<double>(error<Once>(h, d.input));
                        const auto apart = static_cast<double>(error<Twice>(h, d.input));
                        ratio.push_back(fused / apart);
                        once += std::log(fused);
                        twice += std::log(apart);
                    }
        std::sort(ratio.begin(), ratio.end());
        const double drives = static_cast<double>(ratio.size()), median = ratio[ratio.size() / 2];
        const double mean = std::exp((once - twice) / drives);
        std::printf("%s: %zu drives; error, fused over two roundings: median %.2f, geometric mean %.2f; fused %.2g\n",
                    kind == LoopKind::continuous ? "continuous" : "sampled", ratio.size(), median, mean, std::exp(once / drives));
        CHECK(mean < 1.0);
    }
}

}  // namespace gaident
