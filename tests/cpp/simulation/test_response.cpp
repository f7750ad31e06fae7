#include "check.hpp"
#include "gaident/estimation/refine.hpp"
#include "gaident/estimation/statistics.hpp"
#include "gaident/plant/roots.hpp"
#include "gaident/simulation/response.hpp"
#include "gaident/simulation/simulate.hpp"

#include <complex>
#include <numbers>

using namespace gaident;

namespace {

using C = std::complex<double>;

// Two masses: a real pole, a pair of each.
Factors<double> two_masses() {
    const C poles[] = {-4.0, {-10.0, 316.0}, {-10.0, -316.0}}, zeros[] = {{-5.0, 200.0}, {-5.0, -200.0}};
    return factors_from_roots(5000.0, poles, zeros);
}

C plant(C s) {
    const C wide = s * s;
    return 5000.0 * (wide + 10.0 * s + 40025.0) / ((s + 4.0) * (wide + 20.0 * s + 99956.0));
}

std::vector<double> frequencies(std::size_t n) {
    std::vector<double> omega;
    for (std::size_t k = 0; k < n; ++k)
        omega.push_back(10.0 * std::pow(200.0, static_cast<double>(k) / static_cast<double>(n - 1)));
    return omega;
}

// Weights of one per cent, the values of the plant itself.
Response continuous(std::size_t n) {
    std::vector<C> at, value;
    std::vector<double> weight;
    for (const double w : frequencies(n)) {
        at.push_back({0.0, w});
        value.push_back(plant(at.back()));
        weight.push_back(100.0 / std::abs(value.back()));
    }
    return {at, value, weight, 0.0, 10.0, 2000.0, 0.0};
}

double largest_root_error(const Factors<double>& found) {
    const Factors<double> g = two_masses();
    double most = std::abs(found.gain / g.gain - 1.0);
    for (const auto& [x, y] : {std::pair(found.pole, g.pole),
                               {found.pole_pair[0].e1, g.pole_pair[0].e1},
                               {found.pole_pair[0].e0, g.pole_pair[0].e0},
                               {found.zero_pair[0].e1, g.zero_pair[0].e1},
                               {found.zero_pair[0].e0, g.zero_pair[0].e0}})
        most = std::max(most, std::abs(x / y - 1.0));
    return most;
}

Factors<double> moved(double by) {
    Factors<double> g = two_masses();
    g.gain *= 1.0 + by;
    g.pole *= 1.0 - by;
    g.pole_pair[0].e0 *= 1.0 + by;
    g.zero_pair[0].e0 *= 1.0 - by;
    return g;
}

}  // namespace

TEST_CASE("response: that of the factors at every line") {
    const Response r = continuous(150);  // more than two blocks
    std::vector<double> real(150), imaginary(150);
    r.plant(two_masses(), 0, real, imaginary);
    double most = 0.0;
    const std::vector<double> omega = frequencies(150);
    for (std::size_t k = 0; k < omega.size(); ++k) {
        const C exact = plant({0.0, omega[k]});
        most = std::max(most, std::abs(C(real[k], imaginary[k]) - exact) / std::abs(exact));
    }
    CHECK(most < 1e-12);
    CHECK(r.error_sum(two_masses()) < 1e-18);
    // A gain that is 1 % off is off by one deviation at every line.
    Factors<double> g = two_masses();
    g.gain *= 1.01;
    CHECK(std::abs(r.error_sum(g) / 150.0 - 1.0) < 1e-9);
}

TEST_CASE("response: behind a hold it is what a held sine shows") {
    // w(n) in the steady state under u(n) = cos(n x), from a simulation of the held plant.
    const double dt = 1e-3;
    const std::size_t n = 8000, period = 40;
    const double x = 2.0 * std::numbers::pi / static_cast<double>(period);
    std::vector<double> u(n), w(n), torque(n);
    for (std::size_t k = 0; k < n; ++k) u[k] = std::cos(static_cast<double>(k) * x);
    const Loop loop{LoopKind::open, {}};
    simulate<double>(two_masses(), u, dt, loop, nullptr, w, torque);
    C shown = 0.0;
    for (std::size_t k = n - period; k < n; ++k) shown += w[k] * std::exp(C(0.0, -static_cast<double>(k) * x));
    shown *= 2.0 / static_cast<double>(period);
    const C at[] = {std::exp(C(0.0, x)) - 1.0}, value[] = {shown};
    const double weight[] = {1.0};
    const Response r(at, value, weight, dt, x / dt, x / dt, 0.0);
    double real = 0.0, imaginary = 0.0;
    r.plant(two_masses(), 0, {&real, 1}, {&imaginary, 1});
    CHECK(std::abs(C(real, imaginary) - shown) < 1e-9 * std::abs(shown));
}

TEST_CASE("response: fitted alone and beside a record") {
    const Response r = continuous(300);  // more numbers than a chunk has samples
    Experiment experiment;
    experiment.loop.kind = LoopKind::open;
    experiment.responses = {&r};
    experiment.check();
    CHECK(experiment.samples() == 600);
    RefineOptions options;
    options.bounded = false;
    const Refined alone = Refiner(experiment, options).fit(moved(0.03), {}, 60);
    CHECK(alone.converged && largest_root_error(alone.factors) < 1e-6);

    std::vector<double> u(700), w(700), torque(700);
    for (std::size_t k = 0; k < u.size(); ++k) u[k] = k / 100 % 2 == 0 ? 1.0 : -0.5;
    simulate<double>(two_masses(), u, 1e-3, experiment.loop, nullptr, w, torque);
    Record record;
    record.input = u;
    record.output = w;
    record.sample_time = 1e-3;
    experiment.records = {record};
    const Refined both = Refiner(experiment, options).fit(moved(0.03), {}, 60);
    CHECK(both.converged && largest_root_error(both.factors) < 1e-6);

    // The sum of squares is that of both, filtered or not only where the record is.
    Batch batch(experiment, 1, false);
    const Factors<double> g = moved(0.01);
    double sum = 0.0;
    batch.errors(std::span(&g, 1), {&sum, 1});
    Experiment of_record = experiment;
    of_record.responses.clear();
    double part = 0.0;
    Batch(of_record, 1, false).errors(std::span(&g, 1), {&part, 1});
    CHECK(std::abs(sum - part - r.error_sum(g)) < 1e-12 * sum);
    options.whitening = {0.5};
    const Refined filtered = Refiner(experiment, options).fit(g, {}, 0), less = Refiner(of_record, options).fit(g, {}, 0);
    CHECK(std::abs(filtered.cost - less.cost - r.error_sum(g)) < 1e-12 * filtered.cost);

    // What a covariance is made of is the sum of both, too.
    const int lags[] = {1};
    const double phi[] = {0.5};
    const FitSums sums = fit_sums(experiment, g, {}, phi, lags, 0.0), own = fit_sums(of_record, g, {}, phi, lags, 0.0);
    Experiment of_response = experiment;
    of_response.records.clear();
    const FitSums other = fit_sums(of_response, g, {}, {}, lags, 0.0);
    for (std::size_t i = 0; i < sums.plain.size(); ++i) {
        const double size = std::abs(sums.plain[i]) + 1e-300;
        CHECK(std::abs(sums.plain[i] - own.plain[i] - other.plain[i]) < 1e-9 * size);
        CHECK(std::abs(sums.coloured[i] - own.coloured[i] - other.plain[i]) < 1e-9 * (std::abs(sums.coloured[i]) + 1e-300));
    }
}

TEST_CASE("response: refuses what is none") {
    const C at[] = {{0.0, 1.0}};
    const double weight[] = {1.0};
    CHECK_THROWS(Response({}, {}, {}, 0.0, 1.0, 1.0, 0.0), std::invalid_argument);
    CHECK_THROWS(Response(at, {}, weight, 0.0, 1.0, 1.0, 0.0), std::invalid_argument);
    CHECK_THROWS(Response(at, at, weight, 0.0, 0.0, 1.0, 0.0), std::invalid_argument);
}
