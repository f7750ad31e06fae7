#include "check.hpp"
#include "gaident/plant/delta.hpp"

using namespace gaident;

TEST_CASE("delta: a polynomial grows factor by factor") {
    Polynomial<double> f(2.0, 4);
    f.times(1.0, 3.0);        // 2x + 6
    f.times(1.0, -1.0, 2.0);  // (2x + 6)(x^2 - x + 2) = 2x^3 + 4x^2 - 2x + 12
    f.times(2.0, 1.0);        // 4x^4 + 10x^3 + 0x^2 + 22x + 12
    const double expected[] = {4.0, 10.0, 0.0, 22.0, 12.0};
    CHECK(f.size() == 5);
    for (int i = 0; i <= 4; ++i) CHECK(f.c[i] == expected[i]);
}

TEST_CASE("delta: quadratic factors come first or last alike") {
    Polynomial<double> f(1.0, 5), g(1.0, 5);
    f.times(1.0, 2.0, 5.0);
    f.times(3.0, 1.0, 4.0);
    f.times(1.0, 7.0);
    g.times(1.0, 7.0);
    g.times(3.0, 1.0, 4.0);
    g.times(1.0, 2.0, 5.0);
    for (int i = 0; i <= 5; ++i) CHECK(f.c[i] == g.c[i]);
}

TEST_CASE("delta: only the leading coefficients asked for are kept, and they are those of the whole product; size known or not") {
    Polynomial<double> whole(1.5, 7), leading(1.5, 3);
    Polynomial<double, 3> fixed(1.5, 3);
    const auto grow = [](auto& f) {
        f.times(1.0, 2.0, 5.0);
        f.times(0.5, -3.0);
        f.times(3.0, 1.0, 4.0);
        f.times(1.0, 0.25, -2.0);
    };
    grow(whole);
    grow(leading);
    grow(fixed);
    CHECK(whole.c[7] != 0.0 && leading.size() == 4 && fixed.size() == 4);
    for (int i = 0; i <= 3; ++i) CHECK(leading.c[i] == whole.c[i] && fixed.c[i] == whole.c[i]);
}
