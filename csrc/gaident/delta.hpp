// A discrete transfer function in delta = z - 1,
//
//     H(delta) = (b[0] delta^N + b[1] delta^(N-1) + ... + b[N]) / (delta^N + a[0] delta^(N-1) + ... + a[N-1]).
//
// In powers of z the poles of a fast-sampled loop crowd at z = 1 and cancellation destroys the coefficients (METHOD.md section 1: more
// than half of random order-7 models wrong by over 1 % in 32 bits). In delta, with every polynomial *built* in delta, nothing cancels.
#pragma once

#include "factors.hpp"

namespace gaident {

inline constexpr int max_loop_order = max_plant_order + 1;

template <class R>
struct Delta {
    int order = 0;
    R a[max_loop_order]{};
    R b[max_loop_order + 1]{};
};

// A polynomial c[0] x^n + ... + c[n], grown factor by factor.
template <class R>
struct Polynomial {
    int degree = 0;
    R c[max_loop_order + 1]{};

    explicit Polynomial(R leading) { c[0] = leading; }

    // times (k1 x + k0)
    void times(R k1, R k0) {
        R previous = R(0.0);
        for (int i = 0; i <= degree; ++i) {
            const R here = c[i];
            c[i] = k1 * here + k0 * previous;
            previous = here;
        }
        c[++degree] = k0 * previous;
    }

    // times (k2 x^2 + k1 x + k0)
    void times(R k2, R k1, R k0) {
        R first = R(0.0), second = R(0.0);
        for (int i = 0; i <= degree; ++i) {
            const R here = c[i];
            c[i] = (k2 * here + k1 * first) + k0 * second;
            second = first;
            first = here;
        }
        c[degree + 1] = k1 * first + k0 * second;
        c[degree + 2] = k0 * first;
        degree += 2;
    }
};

}  // namespace gaident
