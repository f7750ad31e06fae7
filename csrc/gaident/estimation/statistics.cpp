#include "statistics.hpp"

#include "../simulation/advance.hpp"
#include "../numeric/denormals.hpp"
#include "parameters.hpp"

#include <algorithm>
#include <cmath>

namespace gaident {

namespace {

constexpr std::size_t W = Chunk::width;
constexpr std::size_t unused = ~std::size_t{0};

// Rows of lanes with room for their past in front.
struct Rows {
    std::vector<double> all;
    std::size_t history;

    explicit Rows(std::size_t h) : all((h + chunk_samples) * W, 0.0), history(h) {}
    double* now() { return all.data() + history * W; }
    void clear() { std::fill(all.begin(), all.end(), 0.0); }
    // The last rows of a chunk of n become the past of the next.
    void next(std::size_t n) {
        std::copy(all.begin() + static_cast<std::ptrdiff_t>(n * W), all.begin() + static_cast<std::ptrdiff_t>((n + history) * W),
                  all.begin());
    }
};

// Sums of products between groups of rows, added to a symmetric matrix at the places of their lanes.
class Products {
public:
    std::vector<double> sums;

    Products(const Kernels& kernels, std::size_t size) : sums(size * size, 0.0), kernels_(kernels), size_(size) {}

    void begin(std::vector<std::size_t> places) {
        places_ = std::move(places);
        const std::size_t groups = places_.size() / W;
        blocks_.assign(groups * (groups + 1) / 2 * W * W, 0.0);
    }
    void add(std::span<const double* const> rows, std::size_t n) {
        for (std::size_t g = 0, at = 0; g < rows.size(); ++g)
            for (std::size_t h = 0; h <= g; ++h, ++at) kernels_.gram(rows[g], rows[h], n, blocks_.data() + at * W * W);
    }
    double trace(std::size_t groups) const {
        double sum = 0.0;
        for (std::size_t g = 0; g < groups; ++g)
            for (std::size_t l = 0; l < W; ++l)
                if (places_[g * W + l] != unused) sum += blocks_[((g * (g + 1) / 2 + g) * W + l) * W + l];
        return sum;
    }
    void end() {
        for (std::size_t i = 0; i < places_.size(); ++i)
            for (std::size_t j = 0; j <= i; ++j) {
                if (places_[i] == unused || places_[j] == unused) continue;
                const std::size_t g = i / W, h = j / W;
                const double sum = blocks_[((g * (g + 1) / 2 + h) * W + i % W) * W + j % W];
                sums[places_[i] * size_ + places_[j]] += sum;
                if (i != j) sums[places_[j] * size_ + places_[i]] += sum;
            }
    }

private:
    const Kernels& kernels_;
    std::size_t size_;
    std::vector<std::size_t> places_;
    std::vector<double> blocks_;
};

std::vector<double> point(const Experiment& experiment, const Unknowns& unknowns, const Factors<double>& g,
                          const std::vector<double>& starts) {
    std::vector<double> x = pack(g, starts.empty() ? unknowns.steady_starts(experiment, g) : starts);
    if (x.size() != unknowns.count) throw std::invalid_argument("starts: wrong number of start states for these records");
    return x;
}

}  // namespace

ResidualSums residual_sums(const Experiment& experiment, const Factors<double>& g, const std::vector<double>& starts,
                           std::size_t lags) {
    const FlushDenormals flush;
    const Unknowns unknowns(experiment, g.structure);
    const std::vector<double> x = point(experiment, unknowns, g, starts);
    ResidualSums result;
    result.products.assign(lags + 1, 0.0);
    std::vector<double> e(lags + chunk_samples), part(lags + 1);
    Sweep(experiment).outputs(x, unknowns, [&](std::size_t r, std::size_t first, std::span<const double> y) {
        if (first == 0) std::fill(e.begin(), e.begin() + static_cast<std::ptrdiff_t>(lags), 0.0);
        double* const now = e.data() + lags;
        for (std::size_t n = 0; n < y.size(); ++n) {
            now[n] = experiment.records[r].output[first + n] - y[n];
            result.largest_output = std::max(result.largest_output, std::abs(y[n]));
        }
        std::fill(part.begin(), part.end(), 0.0);
        for (std::size_t n = 0; n < y.size(); ++n) {
            const double* const past = now + n - lags;
            for (std::size_t k = 0; k <= lags; ++k) part[k] += now[n] * past[k];
        }
        for (std::size_t k = 0; k <= lags; ++k) result.products[k] += part[lags - k];
        std::copy(e.begin() + static_cast<std::ptrdiff_t>(y.size()), e.begin() + static_cast<std::ptrdiff_t>(y.size() + lags),
                  e.begin());
    });
    return result;
}

FitSums fit_sums(const Experiment& experiment, const Factors<double>& g, const std::vector<double>& starts,
                 std::span<const double> phi, std::span<const int> lags, double threshold) {
    const FlushDenormals flush;
    const Unknowns unknowns(experiment, g.structure);
    const std::vector<double> x = point(experiment, unknowns, g, starts);
    const Kernels& kernels = *experiment.kernels;
    const std::size_t order = phi.size(), P = unknowns.count, R = lags.size() + 3, extra = (R + W - 1) / W;
    Products plain(kernels, P), coloured(kernels, P), white(kernels, 1 + P + R);
    std::vector<Rows> z, regressors(extra, Rows(order));
    std::vector<std::vector<double>> whitened;
    std::vector<const double*> rows;

    const auto regress = [&](const Chunk& c) {
        const Record& record = experiment.records[c.record];
        const auto lagged = [&](std::size_t n, std::size_t i) {
            const auto k = static_cast<std::size_t>(lags[i]);
            return n >= k ? record.input[n - k] : 0.0;
        };
        for (std::size_t k = 0; k < c.n; ++k) {
            const std::size_t n = c.first + k;
            const double y = record.output[n] - c.rows(0)[k * W];
            std::size_t r = 0;
            const auto put = [&](double v) {
                regressors[r / W].now()[k * W + r % W] = v;
                ++r;
            };
            for (std::size_t i = 0; i < lags.size(); ++i) put(i == 0 ? lagged(n, 0) : lagged(n, i - 1) - lagged(n, i));
            put(1.0);
            put(std::abs(y) > threshold ? (y > 0.0 ? 1.0 : -1.0) : 0.0);
            put(y * std::abs(y));
        }
    };

    Sweep(experiment).linearise(x, unknowns, order, [&](const Chunk& c) {
        const std::size_t groups = c.groups();
        if (c.first == 0) {
            std::vector<std::size_t> own(groups * W, unused), all((groups + extra) * W, unused);
            for (std::size_t i = 0; i < c.unknowns.size(); ++i) {
                const std::size_t lane = i / Chunk::per_group * W + i % Chunk::per_group + 1;
                own[lane] = c.unknowns[i];
                all[lane] = 1 + c.unknowns[i];
            }
            all[0] = 0;
            for (std::size_t r = 0; r < R; ++r) all[groups * W + r] = 1 + P + r;
            plain.begin(own);
            coloured.begin(own);
            white.begin(all);
            z.assign(groups, Rows(order));
            whitened.resize(groups + extra);
            for (auto& w : whitened) w.resize(chunk_samples * W);
            for (Rows& r : regressors) r.clear();
        }
        if (c.response) {
            for (Rows& r : regressors) r.clear();
        } else {
            regress(c);
        }
        rows.clear();
        for (std::size_t i = 0; i < groups; ++i) rows.push_back(c.rows(i));
        plain.add(rows, c.n);
        rows.clear();
        for (std::size_t i = 0; i < groups + extra; ++i) {
            const double* const in = i < groups ? c.rows(i) : regressors[i - groups].now();
            if (c.response) std::copy_n(in, c.n * W, whitened[i].begin());
            else Sweep::whiten(experiment, phi, c.first, c.n, in, whitened[i].data());
            rows.push_back(whitened[i].data());
        }
        white.add(rows, c.n);
        for (Rows& r : regressors) r.next(c.n);
        if (order > 0) {
            rows.clear();
            for (std::size_t i = 0; i < groups; ++i) {
                if (c.response) std::copy_n(c.rows(i), c.n * W, z[i].now());
                else kernels.colour(phi.data(), order, c.rows(i), c.n, z[i].now());
                rows.push_back(z[i].now());
            }
            coloured.add(rows, c.n);
            for (Rows& r : z) r.next(c.n);
        }
        if (!c.is_last()) return;
        if (order > 0 && !c.response) {
            // What the noise makes of J beyond the end of the record, until it has died away; a record says nothing of
            // noise with a memory longer than itself.
            const std::vector<double> silence(chunk_samples * W, 0.0);
            double before = coloured.trace(groups);
            for (std::size_t n = 0; n < c.size; n += chunk_samples) {
                for (std::size_t i = 0; i < groups; ++i) {
                    kernels.colour(phi.data(), order, silence.data(), chunk_samples, z[i].now());
                    rows[i] = z[i].now();
                }
                coloured.add(rows, chunk_samples);
                for (Rows& r : z) r.next(chunk_samples);
                const double now = coloured.trace(groups);
                if (!(now - before > 1e-9 * now)) break;
                before = now;
            }
        }
        plain.end();
        coloured.end();
        white.end();
    });
    if (order == 0) coloured.sums = plain.sums;
    return {P, R, std::move(plain.sums), std::move(coloured.sums), std::move(white.sums)};
}

}  // namespace gaident
