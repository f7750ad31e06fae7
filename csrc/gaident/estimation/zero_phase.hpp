// A low-pass in sections of second order, forward and backward over whole rows: no phase, and the square of its gain.
//
//     v(n) = b_0 e(n) + z_1,   z_1 = z_2 + (b_1 e(n) - a_1 v(n)),   z_2 = b_2 e(n) - a_2 v(n)
//
// Each row is continued by its point reflection at both ends; the filter begins and ends at rest at the value that it finds there,
// which passes it unchanged.
// Rows lie side by side, sample by sample: each of them waits for itself.
// Each throws Stopped soon after `stop` is set, where there is one.
#pragma once

#include "../runtime/stop.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace gaident {

using Section = std::array<double, 6>;  // b_0, b_1, b_2, 1, a_1, a_2

// In place, n samples of `lanes` rows side by side, from rest; `step` is 1, or -1 from the last sample on.
template <std::size_t sections, std::size_t lanes>
void through_sections(const Section* section, double* x, std::size_t n, std::ptrdiff_t step, const std::atomic<bool>* stop) {
    double z[sections][2][lanes] = {};
    if (step < 0) x += (n - 1) * lanes;
    for (std::size_t k = 0; k < n; ++k, x += step * static_cast<std::ptrdiff_t>(lanes)) {
        if (k % samples_between_stops == 0) stop_if_asked(stop);
        double e[lanes], v[lanes];
        std::copy_n(x, lanes, e);
        for (std::size_t s = 0; s < sections; ++s) {
            const auto& [b0, b1, b2, one, a1, a2] = section[s];
            for (std::size_t r = 0; r < lanes; ++r) v[r] = b0 * e[r] + z[s][0][r];
            for (std::size_t r = 0; r < lanes; ++r) z[s][0][r] = z[s][1][r] + (b1 * e[r] - a1 * v[r]);
            for (std::size_t r = 0; r < lanes; ++r) z[s][1][r] = b2 * e[r] - a2 * v[r];
            std::copy_n(v, lanes, e);
        }
        std::copy_n(v, lanes, x);
    }
}

// The same through any number of sections, a few of them at a time.
template <std::size_t lanes>
void through(std::span<const Section> sections, double* x, std::size_t n, std::ptrdiff_t step, const std::atomic<bool>* stop) {
    constexpr std::size_t most = 4;
    using Run = void (*)(const Section*, double*, std::size_t, std::ptrdiff_t, const std::atomic<bool>*);
    static constexpr auto runs = []<std::size_t... less>(std::index_sequence<less...>) {
        return std::array<Run, most>{through_sections<less + 1, lanes>...};
    }(std::make_index_sequence<most>{});
    for (; !sections.empty(); sections = sections.subspan(std::min(most, sections.size())))
        runs[std::min(most, sections.size()) - 1](sections.data(), x, n, step, stop);
}

// `count` rows of n samples, at most `lanes` of them; x: room for (n + 2 extension) lanes.
template <std::size_t lanes>
void zero_phase_of(std::span<const Section> sections, const double* e, double* v, std::size_t count, std::size_t n,
                   std::size_t extension, double* x, const std::atomic<bool>* stop) {
    const std::size_t whole = n + 2 * extension;
    for (std::size_t r = 0; r < lanes; ++r) {
        const double* row = e + std::min(r, count - 1) * n;
        double* to = x + r;
        for (std::size_t k = extension; k > 0; --k, to += lanes) *to = 2.0 * row[0] - row[k];
        for (std::size_t k = 0; k < n; ++k, to += lanes) *to = row[k];
        for (std::size_t k = 1; k <= extension; ++k, to += lanes) *to = 2.0 * row[n - 1] - row[n - 1 - k];
    }
    for (const std::ptrdiff_t step : {1, -1}) {
        double rest[lanes];
        std::copy_n(step > 0 ? x : x + (whole - 1) * lanes, lanes, rest);
        for (std::size_t k = 0; k < whole; ++k)
            for (std::size_t r = 0; r < lanes; ++r) x[k * lanes + r] -= rest[r];
        through<lanes>(sections, x, whole, step, stop);
        for (std::size_t k = 0; k < whole; ++k)
            for (std::size_t r = 0; r < lanes; ++r) x[k * lanes + r] += rest[r];
    }
    for (std::size_t r = 0; r < count; ++r)
        for (std::size_t k = 0; k < n; ++k) v[r * n + k] = x[(k + extension) * lanes + r];
}

// Rows of n samples each, e to v; extension: below n, samples before and after each row.
inline void zero_phase(std::span<const Section> sections, const double* e, double* v, std::size_t rows, std::size_t n,
                       std::size_t extension, const std::atomic<bool>* stop = nullptr) {
    constexpr std::size_t lanes = 8;
    std::vector<double> x((n + 2 * extension) * (rows > 1 ? lanes : 1));
    if (rows == 1) return zero_phase_of<1>(sections, e, v, 1, n, extension, x.data(), stop);
    for (std::size_t first = 0; first < rows; first += lanes)
        zero_phase_of<lanes>(sections, e + first * n, v + first * n, std::min(lanes, rows - first), n, extension, x.data(), stop);
}

}  // namespace gaident
