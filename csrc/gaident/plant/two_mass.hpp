// Two masses on a shaft, built from a linear model with p = 1, q = 2 so that both are the same system exactly (docs/paper.md, six
// numbers, shaft damping D_G free), and their motion over one substep h:
//
//     J_M dw_M/dt = T - c - D_M w_M,   J_L dw_L/dt = c - D_L w_L,   dx/dt = w_M - w_L,   c = K_G x + D_G dx/dt + correction
//
// with motor torque T and correction held over the substep, exactly.
// The twist is kept as psi = x scale, scale = resonance [rad/s], so that the numbers are of one size.
#pragma once

#include "factors.hpp"

#include <algorithm>
#include <cmath>

namespace gaident {

struct TwoMasses {
    double JM, DM, JL, DL, KG, DG;
};

// False where no such mechanism exists.
inline bool two_masses_of(const Factors<double>& g, TwoMasses& m) {
    if (g.structure.p != 1 || g.structure.q != 2) return false;
    const double e1 = g.pole_pair[0].e1, e0 = g.pole_pair[0].e0, a = g.pole;
    const double sum_a = a + e1, pair_a = e0 + a * e1, prod_a = a * e0;
    const double load = g.zero_pair[0].e1, b0 = g.zero_pair[0].e0, K = g.gain;
    if (b0 == 0.0 || K == 0.0) return false;
    // With r = J_L/J_M and d = D_G/J_M:  d = d0 + d1 r,  (b0 - d1^2) r^2 - (pair_a - b0 - motor load + 2 d0 d1) r - d0^2 = 0
    const double motor = sum_a - load;
    const double d0 = 0.5 * (motor - prod_a / b0), d1 = 0.5 * load;
    const double A = b0 - d1 * d1, B = -(pair_a - b0 - motor * load + 2.0 * d0 * d1), C = -d0 * d0;
    const double discriminant = B * B - 4.0 * A * C;
    if (!(discriminant >= 0.0) || A == 0.0) return false;
    const double half = -0.5 * (B + std::copysign(std::sqrt(discriminant), B));
    double r = half / A;
    if (half != 0.0) {
        // Of two inertias the positive one with the smaller shaft damping.
        const double other = C / half;
        const bool better = (other > 0.0) != (r > 0.0) ? other > 0.0 : std::abs(d0 + d1 * other) < std::abs(d0 + d1 * r);
        if (better) r = other;
    }
    if (r == 0.0) return false;
    const double d = d0 + d1 * r;
    m = {1.0 / K, (motor - d) / K, r / K, (load * r - d) / K, b0 * r / K, d / K};
    return true;
}

struct TwoMassStep {
    double phi[3][3];    // e^(A h) - 1 over (w_M, w_L, psi)
    double motor[3];     // response to a unit motor torque
    double coupling[3];  // response to a unit correction of the coupling torque
    double scale;        // psi = twist * scale
};

inline TwoMassStep two_mass_step(const TwoMasses& m, double h) {
    const double scale = std::sqrt(std::abs(m.KG / m.JM) + std::abs(m.KG / m.JL));
    constexpr int n = 5;
    using Matrix = double[n][n];
    Matrix x = {{-(m.DM + m.DG) / m.JM * h, m.DG / m.JM * h, -m.KG / (m.JM * scale) * h, h / m.JM, -h / m.JM},
                {m.DG / m.JL * h, -(m.DL + m.DG) / m.JL * h, m.KG / (m.JL * scale) * h, 0.0, h / m.JL},
                {scale * h, -scale * h, 0.0, 0.0, 0.0}};
    // The inputs' columns do not grow under powers of the states' block, whose norm decides.
    double norm = 0.0;
    for (int i = 0; i < 3; ++i) norm = std::max(norm, std::abs(x[i][0]) + std::abs(x[i][1]) + std::abs(x[i][2]));
    int doublings = 0;
    double factor = 1.0;
    while (norm * factor > 0.125 && doublings < 60) {
        factor *= 0.5;
        ++doublings;
    }
    const auto product = [](const Matrix& a, const Matrix& b, Matrix& out) {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < n; ++j) {
                double sum = 0.0;
                for (int k = 0; k < 3; ++k) sum += a[i][k] * b[k][j];
                out[i][j] = sum;
            }
    };
    for (auto& row : x)
        for (double& v : row) v *= factor;
    Matrix f = {}, t = {};
    std::copy(&x[0][0], &x[0][0] + n * n, &f[0][0]);
    for (int k = 11; k >= 2; --k) {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < n; ++j) f[i][j] /= k;
        product(x, f, t);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < n; ++j) f[i][j] = x[i][j] + t[i][j];
    }
    for (int d = 0; d < doublings; ++d) {
        product(f, f, t);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < n; ++j) f[i][j] = 2.0 * f[i][j] + t[i][j];
    }
    TwoMassStep s{};
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) s.phi[i][j] = f[i][j];
        s.motor[i] = f[i][3];
        s.coupling[i] = f[i][4];
    }
    s.scale = scale;
    return s;
}

}  // namespace gaident
