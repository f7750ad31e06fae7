#include "check.hpp"
#include "drive_bench.hpp"
#include "gaident/estimation/refine.hpp"
#include "gaident/estimation/statistics.hpp"

using namespace gaident;

namespace {

// Two records of one drive, one at rest and one whose start is unknown, longer and shorter than a chunk.
struct Records {
    Bench rest{two_mass(LoopKind::sampled, 1300)}, moving{two_mass(LoopKind::sampled, 400)};
    Experiment experiment;
    Factors<double> model;
    std::vector<double> starts;

    Records() : model(rest.drive.factors()) {
        experiment = rest.experiment;
        experiment.records.push_back(moving.experiment.records[0]);
        experiment.records[1].start = Start::free;
        experiment.records[1].velocity0 = 2.0;
        starts = Unknowns(experiment, model.structure).steady_starts(experiment, model);
        model.gain *= 1.02;  // so that the residual is not noise alone
    }
};

using Columns = std::vector<std::vector<double>>;

double product(const std::vector<double>& x, const std::vector<double>& y) {
    double sum = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += x[i] * y[i];
    return sum;
}

void check_sums(const std::vector<double>& sums, const Columns& columns) {
    const std::size_t n = columns.size();
    CHECK(sums.size() == n * n);
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j) {
            const double scale = std::sqrt(product(columns[i], columns[i]) * product(columns[j], columns[j]));
            CHECK_NEAR(sums[i * n + j], product(columns[i], columns[j]), 1e-11 * scale);
        }
}

}  // namespace

TEST_CASE("statistics: sums over the residual equal those over its samples, record by record") {
    const Records r;
    std::vector<double> e, columns;
    Refiner(r.experiment, {}).sensitivities(r.model, r.starts, e, columns);
    const ResidualSums sums = residual_sums(r.experiment, r.model, r.starts, 30);
    for (std::size_t k = 0; k <= 30; ++k) {
        double expected = 0.0;
        for (std::size_t n = 0; n + k < e.size(); ++n)
            if ((n < 1300) == (n + k < 1300)) expected += e[n] * e[n + k];
        CHECK_NEAR(sums.products[k], expected, 1e-10 * sums.products[0]);
    }
    double largest = 0.0;
    for (std::size_t n = 0; n < e.size(); ++n)
        largest = std::max(largest, std::abs(r.experiment.records[n < 1300 ? 0 : 1].output[n < 1300 ? n : n - 1300] - e[n]));
    CHECK_NEAR(sums.largest_output, largest, 1e-12 * largest);
}

TEST_CASE("statistics: products of derivatives and regressors equal those of whole arrays") {
    const Records r;
    const std::vector<int> lags{0, 1, 4, 32};
    std::vector<double> e, J;
    Refiner(r.experiment, {}).sensitivities(r.model, r.starts, e, J);
    const std::size_t N = e.size(), P = J.size() / N;
    for (const std::vector<double>& phi : {std::vector<double>{}, std::vector<double>{0.5, 0.3, -0.1}}) {
        const FitSums sums = fit_sums(r.experiment, r.model, r.starts, phi, lags, 5.0);
        CHECK(sums.unknowns == P && sums.regressors == 7);
        Columns plain, coloured, white;
        const auto put = [&](const std::vector<double>& x) {
            white.emplace_back(N, 0.0);
            for (const auto& [first, last] : {std::pair<std::size_t, std::size_t>{0, 1300}, {1300, N}})
                for (std::size_t n = first + phi.size(); n < last; ++n) {
                    white.back()[n] = x[n];
                    for (std::size_t i = 0; i < phi.size(); ++i) white.back()[n] -= phi[i] * x[n - 1 - i];
                }
        };
        put(e);
        for (std::size_t p = 0; p < P; ++p) {
            plain.emplace_back(J.begin() + static_cast<std::ptrdiff_t>(p * N),
                               J.begin() + static_cast<std::ptrdiff_t>((p + 1) * N));
            put(plain.back());
            // Coloured record by record, each with room to die away in.
            coloured.emplace_back();
            for (const auto& [first, last] : {std::pair<std::size_t, std::size_t>{0, 1300}, {1300, N}}) {
                const std::size_t base = coloured.back().size();
                for (std::size_t n = first; n < last + 2000; ++n) {
                    double z = n < last ? plain.back()[n] : 0.0;
                    for (std::size_t i = 0; i < phi.size() && n - first > i; ++i)
                        z += phi[i] * coloured.back()[base + n - first - 1 - i];
                    coloured.back().push_back(z);
                }
            }
        }
        for (std::size_t kind = 0; kind < 7; ++kind) {
            std::vector<double> x;
            for (const Record& record : r.experiment.records)
                for (std::size_t n = 0; n < record.size(); ++n) {
                    const double y = record.output[n] - e[x.size()];
                    const auto u = [&](std::size_t i) {
                        const auto lag = static_cast<std::size_t>(lags[i]);
                        return n >= lag ? record.input[n - lag] : 0.0;
                    };
                    x.push_back(kind == 0   ? u(0)
                                : kind < 4  ? u(kind - 1) - u(kind)
                                : kind == 4 ? 1.0
                                : kind == 5 ? (std::abs(y) > 5.0 ? std::copysign(1.0, y) : 0.0)
                                            : y * std::abs(y));
                }
            put(x);
        }
        check_sums(sums.plain, plain);
        check_sums(sums.coloured, coloured);
        check_sums(sums.white, white);
    }
}
