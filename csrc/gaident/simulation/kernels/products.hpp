// Sums of products over rows of lanes, for the normal equations of a local fit; instantiated beside the sample loops.
// A row is one sample, double_lanes numbers: the error and its derivatives, or regressors.
#pragma once

#include "../../numeric/lanes.hpp"
#include "kernels.hpp"

#include <cstddef>

namespace gaident {

template <class Isa>
struct ProductSource {
    static constexpr int W = double_lanes;
    using L = Lanes<double, W, Isa>;

    // sums[i][j] += sum_k a[k][i] b[k][j]
    static void gram(const double* a, const double* b, std::size_t n, double* sums) {
        // As many rows of sums at a time as the registers take.
        constexpr int T = L::registers == 1 ? 8 : L::registers == 2 ? 4 : 2;
        for (int i = 0; i < W; i += T) {
            L part[T];
            for (int t = 0; t < T; ++t) part[t] = L(0.0);
            for (std::size_t k = 0; k < n; ++k) {
                const L row = L::load(b + k * W);
#pragma GCC unroll 8
                for (int t = 0; t < T; ++t) part[t] = fma(L::all(a[k * W + static_cast<std::size_t>(i + t)]), row, part[t]);
            }
            for (int t = 0; t < T; ++t) {
                double* const sum = sums + static_cast<std::size_t>(i + t) * W;
                (L::load(sum) + part[t]).store(sum);
            }
        }
    }

    // Outputs y of a point (lane 0) and of its neighbours, in place, into the error and its derivatives:
    // row[k][0] = output[k] - y, and row[k][l] = scale[l] (y - row[k][l]).
    static void differences(const double* scale, const double* output, std::size_t n, double* rows) {
        const L s = L::load(scale);
        for (std::size_t k = 0; k < n; ++k) {
            double* const row = rows + k * W;
            const double y = row[0];
            (s * (L::all(y) - L::load(row))).store(row);
            row[0] = output[k] - y;
        }
    }

    // out[k] = in[k] - sum_i phi[i] in[k - 1 - i]; `order` rows of history stand in front of `in`.
    static void whiten(const double* phi, std::size_t order, const double* in, std::size_t n, double* out) {
        for (std::size_t k = 0; k < n; ++k) {
            L v = L::load(in + k * W);
            const double* past = in + k * W;
            for (std::size_t i = 0; i < order; ++i) {
                past -= W;
                v = fnma(L::all(phi[i]), L::load(past), v);
            }
            v.store(out + k * W);
        }
    }

    // z[k] = in[k] + sum_i phi[i] z[k - 1 - i]; `order` rows of history stand in front of `z`.
    static void colour(const double* phi, std::size_t order, const double* in, std::size_t n, double* z) {
        for (std::size_t k = 0; k < n; ++k) {
            L v = L::load(in + k * W);
            const double* past = z + k * W;
            for (std::size_t i = order; i-- > 0;) v = fma(L::all(phi[i]), L::load(past - (i + 1) * W), v);
            v.store(z + k * W);
        }
    }
};

}  // namespace gaident
