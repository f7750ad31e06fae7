// Prints the bits of whole identifications through the C interface: the fits that searches find, what goes on from them, the sums that
// their statistics are made of, and a run of each. Compared between WebAssembly and this machine, which must not differ.
// Before them, how many products and sums in one differ from the C library's, which are exact, and a digest of those of floats (whose
// function in WebAssembly's library rounds twice now and then).
#include "wasm/interface.h"

#include "gaident/numeric/arithmetic.hpp"
#include "gaident/numeric/bit_cast.hpp"
#include "gaident/numeric/rng.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <vector>

using namespace gaident;

namespace {

void say(const char* what, const double* values, int n) {
    std::printf("%s", what);
    for (int i = 0; i < n; ++i) std::printf(" %a", values[i]);
    std::printf("\n");
}

// Operands of all sizes, few bits and many, sums that cancel, zeros with their signs.
int wrong_products(int count, std::uint64_t& digest) {
    Random random(5);
    const auto number = [&](int largest) {
        const std::uint64_t word = random.word();
        double m = 1.0 + random.uniform();
        if ((word >> 40 & 7) == 0) m = 1.0 + static_cast<double>(word & 7) / 8.0;
        if ((word >> 50 & 15) == 0) m = 2.0 - static_cast<double>(word & 3) * 0x1p-52;
        const int exponent = static_cast<int>(random.below(static_cast<std::uint32_t>(2 * largest + 1))) - largest;
        return std::ldexp(word >> 63 != 0 ? m : -m, exponent);
    };
    const auto same = [](double x, double y) {
        return bit_cast<std::uint64_t>(x) == bit_cast<std::uint64_t>(y) || (x != x && y != y);
    };
    constexpr int sizes[] = {1, 30, 400, 1070};
    int wrong = 0;
    for (int i = 0; i < count; ++i) {
        const int largest = sizes[i % 4];
        double a = number(largest);
        const double b = number(largest);
        double c = number(largest);
        if (i % 5 == 0) c = -a * b;
        if (i % 7 == 0) c = std::ldexp(a * b, -static_cast<int>(random.below(110)));
        if (i % 101 == 0) a = 0.0;
        if (i % 103 == 0) c = -0.0;
        const double exact = __builtin_fma(a, b, c);
        if (!same(gaident::fma(a, b, c), exact)) ++wrong;
        const auto x = static_cast<float>(a), y = static_cast<float>(b), z = static_cast<float>(c);
        const float of_floats = gaident::fma(x, y, z);
        if (of_floats == of_floats) digest = mix(digest + bit_cast<std::uint32_t>(of_floats));
    }
    return wrong;
}

// The number that a function returned, or the end of the program.
int checked(int returned) {
    if (returned < 0) {
        std::printf("refused: %s\n", gaident_message());
        std::exit(1);
    }
    return returned;
}

// A session of the plant's answer to an input with noise on it, both made of nothing but the core's own arithmetic.
gaident_session* session_of(const std::vector<double>& input, int moving, enum gaident_loop loop, double torque_limit) {
    constexpr double sample_time = 0.444e-3, unlimited = std::numeric_limits<double>::infinity();
    const double controller[] = {0.129, 7.6, torque_limit, unlimited};
    const double poles[] = {-15.41, 0.0, -10.3, 150.9, -10.3, -150.9}, zeros[] = {-4.26, 93.98, -4.26, -93.98};
    const int n = static_cast<int>(input.size());
    std::vector<double> velocity(input.size()), torque(input.size());
    gaident_session* const drive = gaident_open(input.data(), input.data(), n, sample_time, 0, 0.0, loop, controller);
    if (drive == nullptr) checked(-1);
    checked(gaident_simulate(drive, checked(gaident_fit(drive, 6545.29, poles, 3, zeros, 2, nullptr, 0, 0, 1e-9)),
                             velocity.data(), torque.data()));
    gaident_close(drive);
    Random random(17);
    for (double& w : velocity)
        for (int k = 0; k < 12; ++k) w += 0.3 * (random.uniform() - 0.5);
    gaident_session* const session =
        gaident_open(input.data(), velocity.data(), n, sample_time, moving, velocity[0], loop, controller);
    if (session == nullptr) checked(-1);
    const double longest = n * sample_time;
    const double ranges[] = {1e2,  1e5,  -10.0 / longest, 1.0 / sample_time, 0.5 / longest, 2.5 / sample_time, 1.0, 3.0, 0.0, 3.0,
                             10.0, 100.0};
    checked(gaident_set_ranges(session, ranges));
    return session;
}

void identified(const char* name, const std::vector<double>& input, int moving, enum gaident_loop loop,
                double torque_limit = std::numeric_limits<double>::infinity()) {
    gaident_session* const session = session_of(input, moving, loop, torque_limit);
    const double settings[] = {50, 2, 0.9, 0.01, 1000, 40, 1, 1, 1, 1.0, 2.0};
    const int fits = checked(gaident_search(session, settings, 5));
    std::printf("%s: %d structures\n", name, fits);
    double numbers[gaident_fit_numbers], sums[2000];
    const double phi[] = {0.4, -0.1};
    const int lags[] = {0, 1, 2, 4};
    for (int i = 0; i < fits; ++i) {
        say("fit", numbers, checked(gaident_read_fit(session, i, numbers)));
        const int whitened = checked(gaident_go_on(session, i, phi, 2, 8, 1e-6));
        say("whitened", numbers, checked(gaident_read_fit(session, whitened, numbers)));
        say("residual", sums, checked(gaident_residual_sums(session, i, 10, sums)));
        const int unknowns = checked(gaident_fit_sums(session, i, phi, 2, lags, 4, 0.1, sums, 2000));
        say("sums", sums, 2 * unknowns * unknowns);
    }
    const int n = static_cast<int>(input.size());
    std::vector<double> velocity(input.size()), torque(input.size());
    checked(gaident_simulate(session, fits - 1, velocity.data(), torque.data()));
    say("velocity", velocity.data(), n);
    say("torque", torque.data(), n);
    gaident_close(session);
}

}  // namespace

int main() {
    std::uint64_t digest = 0;
    const int compared = 400000, wrong = wrong_products(compared, digest);
    std::printf("products and sums in one: %d compared, %d wrong; of floats %016llx\n", compared, wrong,
                static_cast<unsigned long long>(digest));
    if (wrong > 0) return 1;
    const std::vector<double> step(250, 43.6);
    std::vector<double> square(step), torque(600);
    for (std::size_t k = 0; k < square.size(); ++k) square[k] = k / 40 % 2 == 0 ? 30.0 : -10.0;
    for (std::size_t k = 0; k < torque.size(); ++k) torque[k] = k / 50 % 2 == 0 ? 0.3 : -0.2;
    identified("continuous loop, step", step, 0, gaident_continuous_loop);
    identified("sampled loop, square wave", square, 0, gaident_sampled_loop);
    identified("sampled loop, limited", square, 0, gaident_sampled_loop, 0.8);
    identified("open loop, in motion", torque, 1, gaident_open_loop);
}
