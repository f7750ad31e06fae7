// One rounding instead of two: what it is, that every instruction set has it, and what it is worth.
#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/numeric/elementary.hpp"

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
