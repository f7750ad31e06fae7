// Sums of lagged products, and rational filters over whole rows, from rest:
//
//     v(n) = sum_i b_i e(n-i) - sum_{i>=1} a_i v(n-i),   a_0 = 1
//
// First the sum over e, a shifted row for each b_i; then the recursion in transposed direct form,
//
//     v(n) = f(n) + z_1,   z_i = z_{i+1} - a_i v(n),
//
// a few rows side by side, since each waits for itself; and linear recursions of complex states.
// Each throws Stopped soon after `stop` is set, where there is one.
#pragma once

#include "../runtime/stop.hpp"

#include <algorithm>
#include <array>
#include <complex>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace gaident {

constexpr int max_recursion = 16;  // numbers a_1, a_2, ... of a filter

// The sum over as many samples at a time as stay in registers.
inline void moving_sum(std::span<const double> b, const double* e, double* v, std::size_t n,
                       const std::atomic<bool>* stop = nullptr) {
    constexpr std::size_t block = 16;
    const std::size_t order = b.size() - 1;
    const auto one = [&](std::size_t k) {
        double sum = b[0] * e[k];
        for (std::size_t i = 1; i <= std::min(order, k); ++i) sum += b[i] * e[k - i];
        v[k] = sum;
    };
    std::size_t k = 0;
    for (; k < std::min(order, n); ++k) one(k);
    for (std::size_t looked = k; k + block <= n; k += block) {
        if (k - looked >= samples_between_stops) {
            stop_if_asked(stop);
            looked = k;
        }
        double sum[block];
        for (std::size_t j = 0; j < block; ++j) sum[j] = b[0] * e[k + j];
        for (std::size_t i = 1; i <= order; ++i)
            for (std::size_t j = 0; j < block; ++j) sum[j] += b[i] * e[k + j - i];
        std::copy_n(sum, block, v + k);
    }
    for (; k < n; ++k) one(k);
}

// From what was measured (n): measured - row, in place. A row that comes to `lost`, or is no number, is `lost` everywhere.
inline void subtracted(const double* measured, double* rows, std::size_t count, std::size_t n, double lost) {
    for (std::size_t r = 0; r < count; ++r, rows += n) {
        bool kept = true;
        for (std::size_t k = 0; k < n; ++k) {
            rows[k] = measured[k] - rows[k];
            kept &= rows[k] < lost && rows[k] > -lost;
        }
        if (!kept) std::fill_n(rows, n, lost);
    }
}

// In place; rows `stride` apart.
template <int order, int rows>
void recursion(const double* a, double* v, std::size_t stride, std::size_t n, const std::atomic<bool>* stop) {
    double z[order + 1][rows] = {};
    for (std::size_t k = 0; k < n; ++k) {
        if (k % samples_between_stops == 0) stop_if_asked(stop);
        double y[rows];
        for (int r = 0; r < rows; ++r) y[r] = v[static_cast<std::size_t>(r) * stride + k] + z[0][r];
        for (int i = 0; i < order; ++i)
            for (int r = 0; r < rows; ++r) z[i][r] = z[i + 1][r] - a[i + 1] * y[r];
        for (int r = 0; r < rows; ++r) v[static_cast<std::size_t>(r) * stride + k] = y[r];
    }
}

template <int order>
void recursions(const double* a, double* v, std::size_t rows, std::size_t stride, std::size_t n, const std::atomic<bool>* stop) {
    std::size_t r = 0;
    for (; r + 4 <= rows; r += 4) recursion<order, 4>(a, v + r * stride, stride, n, stop);
    for (; r < rows; ++r) recursion<order, 1>(a, v + r * stride, stride, n, stop);
}

// Rows of e to rows of v, `stride` apart, each row cut into records of these lengths. a has at most 1 + max_recursion numbers.
inline void filtered(std::span<const double> b, std::span<const double> a, const double* e, double* v, std::size_t rows,
                     std::size_t stride, std::span<const std::size_t> lengths, const std::atomic<bool>* stop = nullptr) {
    using Run = void (*)(const double*, double*, std::size_t, std::size_t, std::size_t, const std::atomic<bool>*);
    static constexpr auto runs = []<int... order>(std::integer_sequence<int, order...>) {
        return std::array<Run, sizeof...(order)>{recursions<order>...};
    }(std::make_integer_sequence<int, max_recursion + 1>{});
    std::size_t at = 0;
    for (const std::size_t n : lengths) {
        for (std::size_t r = 0; r < rows; ++r) moving_sum(b, e + r * stride + at, v + r * stride + at, n, stop);
        if (a.size() > 1) runs[a.size() - 1](a.data(), v + at, rows, stride, n, stop);
        at += n;
    }
}

// The sums of (weight v)^2 of one row e under `lanes` filters side by side, in transposed direct form,
//
//     v(n) = b_0 e(n) + z_1,   z_i = b_i e(n) - a_i v(n) + z_{i+1}
//
// b, a: order + 1 numbers of each filter, numbers of the same power of q side by side.
template <int order, int lanes>
void powers(const double* b, const double* a, const double* e, const double* weight, std::span<const std::size_t> lengths,
            double* sums, const std::atomic<bool>* stop) {
    double sum[lanes] = {};
    for (const std::size_t length : lengths) {
        double z[order + 1][lanes] = {};
        for (std::size_t k = 0; k < length; ++k) {
            if (k % samples_between_stops == 0) stop_if_asked(stop);
            double v[lanes];
            for (int r = 0; r < lanes; ++r) v[r] = b[r] * e[k] + z[0][r];
            for (int i = 0; i < order; ++i)
                for (int r = 0; r < lanes; ++r)
                    z[i][r] = z[i + 1][r] + (b[(i + 1) * lanes + r] * e[k] - a[(i + 1) * lanes + r] * v[r]);
            for (int r = 0; r < lanes; ++r) sum[r] += (weight[k] * v[r]) * (weight[k] * v[r]);
        }
        e += length;
        weight += length;
    }
    std::copy_n(sum, lanes, sums);
}

// The same of any number of filters: rows of b and of a, `size` numbers each, at most 1 + max_recursion.
inline void filtered_powers(const double* b, const double* a, std::size_t filters, std::size_t size, const double* e,
                            const double* weight, std::span<const std::size_t> lengths, double* sums,
                            const std::atomic<bool>* stop = nullptr) {
    constexpr std::size_t lanes = 4;
    using Run = void (*)(const double*, const double*, const double*, const double*, std::span<const std::size_t>, double*,
                         const std::atomic<bool>*);
    static constexpr auto runs = []<int... order>(std::integer_sequence<int, order...>) {
        return std::array<Run, sizeof...(order)>{powers<order, lanes>...};
    }(std::make_integer_sequence<int, max_recursion + 1>{});
    for (std::size_t first = 0; first < filters; first += lanes) {
        double B[(max_recursion + 1) * lanes], A[(max_recursion + 1) * lanes], sum[lanes];
        for (std::size_t r = 0; r < lanes; ++r)
            for (std::size_t i = 0; i < size; ++i) {
                const std::size_t from = std::min(first + r, filters - 1) * size + i;
                B[i * lanes + r] = b[from];
                A[i * lanes + r] = a[from];
            }
        runs[size - 1](B, A, e, weight, lengths, sum, stop);
        std::copy_n(sum, std::min(lanes, filters - first), sums + first);
    }
}

// products[k] = sum_n e(n) e(n-k), k = 0, 1, ...; in four sums, so that none waits for itself.
inline void lagged_products(const double* e, std::size_t n, std::span<double> products, const std::atomic<bool>* stop = nullptr) {
    for (std::size_t k = 0; k < products.size(); ++k) {
        stop_if_asked(stop);
        double part[4] = {};
        std::size_t i = std::min(k, n);
        for (; i + 4 <= n; i += 4)
            for (std::size_t j = 0; j < 4; ++j) part[j] += e[i + j] * e[i + j - k];
        for (; i < n; ++i) part[0] += e[i] * e[i - k];
        products[k] = (part[0] + part[1]) + (part[2] + part[3]);
    }
}

// x(k+1) = A x(k) + f(k) from x(0): rows f(0..n-1) of m states become x(0..n-1), with `newest` x(1..n). A row-major.
inline void state_recursion(const std::complex<double>* A, std::span<const std::complex<double>> start, std::complex<double>* f,
                            std::size_t n, bool newest, const std::atomic<bool>* stop = nullptr) {
    const std::size_t m = start.size();
    std::vector<std::complex<double>> now(start.begin(), start.end()), next(m);
    for (std::size_t k = 0; k < n; ++k, f += m) {
        if (k % samples_between_stops == 0) stop_if_asked(stop);
        for (std::size_t i = 0; i < m; ++i) {
            double re = f[i].real(), im = f[i].imag();  // the library's product looks for infinities
            for (std::size_t j = 0; j < m; ++j) {
                const std::complex<double> a = A[i * m + j], x = now[j];
                re += a.real() * x.real() - a.imag() * x.imag();
                im += a.real() * x.imag() + a.imag() * x.real();
            }
            next[i] = {re, im};
        }
        std::copy_n((newest ? next : now).begin(), m, f);
        now.swap(next);
    }
}

}  // namespace gaident
