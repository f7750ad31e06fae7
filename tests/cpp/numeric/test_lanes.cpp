#include "check.hpp"
#include "gaident/numeric/lanes.hpp"
#include "gaident/numeric/rng.hpp"

using namespace gaident;

namespace {

template <int bytes>
struct Isa {
    static constexpr int register_bytes = bytes;
};

template <class T, int W, int bytes>
void compare() {
    using L = Lanes<T, W, Isa<bytes>>;
    static_assert(Arithmetic<L>);
    Random random(71);
    for (int repeat = 0; repeat < 500; ++repeat) {
        T a[W], b[W], c[W], out[W];
        for (T* x : {a, b, c})
            for (int i = 0; i < W; ++i) x[i] = static_cast<T>(random.uniform() - 0.5);
        const L x = L::load(a), y = L::load(b);
        const auto check = [&](L result, auto&& expected) {
            result.store(out);
            for (int i = 0; i < W; ++i) CHECK(out[i] == expected(a[i], b[i]));
        };
        check(x + y, [](T u, T v) { return u + v; });
        check(x - y, [](T u, T v) { return u - v; });
        check(x * y, [](T u, T v) { return u * v; });
        check(x / y, [](T u, T v) { return u / v; });
        check(-x, [](T u, T) { return -u; });
        const L lo(-0.2), hi(0.3);
        check(clamp(x, lo, hi), [](T u, T) { return clamp(u, static_cast<T>(-0.2), static_cast<T>(0.3)); });
    }
}

}  // namespace

TEST_CASE("lanes: every lane computes what a scalar would, whatever the register's width") {
    compare<double, 8, 16>();
    compare<double, 8, 32>();
    compare<double, 8, 64>();
    compare<float, 16, 16>();
    compare<float, 16, 64>();
    compare<double, 2, 16>();
}
