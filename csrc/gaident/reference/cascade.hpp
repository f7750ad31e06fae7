// The referee of the simulation: the PI loop around a cascade of factor modules, in the paper's order,
//
//     u -> G0 = K -> G11 -> G12 ... -> G21 -> G22 ... -> w
//
// every module a difference equation of its own in powers of z, with its own past. Conjugate pairs make one module of order two.
// Slow and obvious; it shares no line with the fast path. Run in long double or wider where its own rounding matters.
#pragma once

#include "../control/controller.hpp"
#include "bits.hpp"

#include <array>
#include <span>
#include <vector>

namespace gaident::reference {

// (n[0] s^order + ... + n[order]) / (d[0] s^order + ... + d[order])
template <class R>
struct Module {
    int order;
    std::array<R, 3> n, d;
};

template <class R>
struct System {
    R K;
    std::vector<Module<R>> modules;
};

// (s + a)(s + b), the two both real or conjugates.
template <class R>
std::array<R, 3> product(Complex a, Complex b) {
    const R re1 = R(a.real()), im1 = R(a.imag()), re2 = R(b.real()), im2 = R(b.imag());
    return {R(1), re1 + re2, re1 * re2 - im1 * im2};
}

// Equation (3): G = G0 prod G1i prod G2j.
template <class R>
System<R> factor_modules(const Plant& g) {
    System<R> G{R(g.K), {}};
    const auto real = [](Complex a) { return R(a.real()); };
    const auto complex = [](Complex a) { return a.imag() != 0.0; };
    const std::size_t p = g.A1.size(), q = g.A2.size();
    // 1/(s + A1), and 1/((s + A1)(s + A1')) for a conjugate pair
    for (std::size_t i = 0; i < p; ++i) {
        if (!complex(g.A1[i])) {
            G.modules.push_back({1, {R(0), R(1), R(0)}, {R(1), real(g.A1[i]), R(0)}});
        } else if (i + 1 < p) {
            G.modules.push_back({2, {R(0), R(0), R(1)}, product<R>(g.A1[i], g.A1[i + 1])});
            ++i;
        }  // else its conjugate is the last A2
    }
    // (s + B2)/(s + A2), and two such modules as one where either pair is conjugate
    for (std::size_t j = 0; j < q; ++j) {
        if (j + 1 < q && (complex(g.A2[j]) || complex(g.B2[j]))) {
            G.modules.push_back({2, product<R>(g.B2[j], g.B2[j + 1]), product<R>(g.A2[j], g.A2[j + 1])});
            ++j;
        } else if (complex(g.A2[j])) {
            G.modules.push_back({2, {R(0), R(1), real(g.B2[j])}, product<R>(g.A1[p - 1], g.A2[j])});
        } else {
            G.modules.push_back({1, {R(1), real(g.B2[j]), R(0)}, {R(1), real(g.A2[j]), R(0)}});
        }
    }
    return G;
}

// One module under s = c (z-1)/(z+1), c = 2/Ts:
//     a0 y(n) = b0 u(n) + b1 u(n-1) + b2 u(n-2) - a1 y(n-1) - a2 y(n-2),   or  y(n) = g u(n) + h  with h the past's
// share.
template <class R>
class DifferenceEquation {
public:
    DifferenceEquation(const Module<R>& m, double sample_time)
        : a_(in_z(m.d, m.order, sample_time)), b_(in_z(m.n, m.order, sample_time)) {}

    R g() const { return b_[0] / a_[0]; }
    R h() const { return (b_[1] * u1_ + b_[2] * u2_ - a_[1] * y1_ - a_[2] * y2_) / a_[0]; }
    R step(R u) {
        const R y = g() * u + h();
        u2_ = u1_;
        u1_ = u;
        y2_ = y1_;
        y1_ = y;
        return y;
    }

private:
    static std::array<R, 3> in_z(const std::array<R, 3>& s, int order, double sample_time) {
        const R c = R(2) / R(sample_time);
        if (order == 1) return {s[0] * c + s[1], s[1] - s[0] * c, R(0)};
        return {s[0] * c * c + s[1] * c + s[2], R(2) * s[2] - R(2) * s[0] * c * c, s[0] * c * c - s[1] * c + s[2]};
    }
    std::array<R, 3> a_, b_;
    R u1_ = R(0), u2_ = R(0), y1_ = R(0), y2_ = R(0);
};

template <class R>
struct Response {
    std::vector<R> velocity, torque;
};

template <class R>
R limited(R x, double limit) {
    if (limit < std::numeric_limits<double>::infinity() && x > R(limit)) return R(limit);
    if (limit < std::numeric_limits<double>::infinity() && x < -R(limit)) return -R(limit);
    return x;
}

// The PI controller's memory: I(n-1) and e(n-1).
template <class R>
struct Regulator {
    double kp, ki, sample_time, torque_limit, integrator_limit;
    R I = R(0), e = R(0);

    Regulator(const Loop& loop, double Ts)
        : kp(loop.controller.kp),
          ki(loop.controller.ki),
          sample_time(Ts),
          torque_limit(loop.controller.torque_limit),
          integrator_limit(loop.controller.integrator_limit) {}

    R integral(R error) const { return limited<R>(I + R(ki) * R(sample_time) / R(2) * (error + e), integrator_limit); }
    R torque(R error) const { return limited<R>(R(kp) * error + integral(error), torque_limit); }
    void advance(R error) {
        I = integral(error);
        e = error;
    }

    // The torque u with u = torque(r - H - G u): each limit is either not reached, or reached above or below.
    // The right one of the nine cases is the one that the controller itself agrees with.
    R solve(R r, R G, R H) const {
        const R half = R(ki) * R(sample_time) / R(2), free = r - H;
        const R u_free = ((R(kp) + half) * free + I + half * e) / (R(1) + G * (R(kp) + half));
        R best = u_free, miss = distance(u_free, torque(free - G * u_free));
        const auto attempt = [&](R u) {
            const R d = distance(u, torque(free - G * u));
            if (d < miss) {
                best = u;
                miss = d;
            }
        };
        if (integrator_limit < std::numeric_limits<double>::infinity())
            for (const double at : {integrator_limit, -integrator_limit}) attempt((R(kp) * free + R(at)) / (R(1) + G * R(kp)));
        if (torque_limit < std::numeric_limits<double>::infinity())
            for (const double at : {torque_limit, -torque_limit}) attempt(R(at));
        return best;
    }

private:
    static R distance(R a, R b) { return a < b ? b - a : a - b; }
};

// loop="continuous": command -> velocity, everything bilinear, the algebraic loop solved within the sample: with
// every module y = g u + h the whole chain is w = G u + H.
template <class R>
Response<R> run_continuous(const System<R>& system, std::span<const double> command, double Ts, const Loop& loop) {
    std::vector<DifferenceEquation<R>> chain;
    for (const Module<R>& m : system.modules) chain.emplace_back(m, Ts);
    Regulator<R> pi(loop, Ts);
    Response<R> out;
    for (const double command_now : command) {
        const R r = R(command_now);
        R G = system.K, H = R(0);
        for (const auto& module : chain) {
            G = module.g() * G;
            H = module.g() * H + module.h();
        }
        const R u = pi.solve(r, G, H);
        R w = system.K * u;
        for (auto& module : chain) w = module.step(w);
        pi.advance(r - w);
        out.velocity.push_back(w);
        out.torque.push_back(u);
    }
    return out;
}

// ------------------------------------------------------------------------- the plant behind a zero-order hold

template <class R>
using Matrix = std::vector<std::vector<R>>;

template <class R>
Matrix<R> multiply(const Matrix<R>& x, const Matrix<R>& y) {
    const std::size_t n = x.size();
    Matrix<R> z(n, std::vector<R>(n, R(0)));
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j)
            for (std::size_t k = 0; k < n; ++k) z[i][j] = z[i][j] + x[i][k] * y[k][j];
    return z;
}

// e^M by scaling, a long Taylor series, and squaring.
template <class R>
Matrix<R> exponential(Matrix<R> M) {
    const std::size_t n = M.size();
    double norm = 0.0;
    for (const auto& row : M) {
        double sum = 0.0;
        for (const R& e : row) sum += std::abs(static_cast<double>(e));
        norm = std::max(norm, sum);
    }
    int squarings = 0;
    for (; norm > 0.5; norm *= 0.5) ++squarings;
    for (auto& row : M)
        for (R& e : row)
            for (int k = 0; k < squarings; ++k) e = e / R(2);
    Matrix<R> sum(n, std::vector<R>(n, R(0)));
    for (std::size_t i = 0; i < n; ++i) sum[i][i] = R(1);
    Matrix<R> term = sum;
    for (int k = 1; k <= 30; ++k) {
        term = multiply(term, M);
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < n; ++j) {
                term[i][j] = term[i][j] / R(k);
                sum[i][j] = sum[i][j] + term[i][j];
            }
    }
    for (int k = 0; k < squarings; ++k) sum = multiply(sum, sum);
    return sum;
}

// The chain of modules as dx/dt = A x + B u, w = C x (+ D u), in time units of Ts; then x(n+1) = Phi x(n) + Gamma u(n).
template <class R>
class HeldPlant {
public:
    HeldPlant(const System<R>& system, double sample_time) : K_(system.K) {
        std::size_t n = 0;
        for (const Module<R>& m : system.modules) n += static_cast<std::size_t>(m.order);
        Matrix<R> M(n + 1, std::vector<R>(n + 1, R(0)));  // [A B; 0 0]
        std::vector<R> y(n + 1, R(0));                    // the chain's signal as a row over [x, K u]
        y[n] = R(1);
        std::size_t at = 0;
        const R Ts = R(sample_time);
        for (const Module<R>& m : system.modules) {
            const std::vector<R> v = y;
            if (m.order == 1) {  // x' = v - d1 x,   y = n0 v + (n1 - n0 d1) x
                const R d1 = m.d[1] * Ts, n0 = m.n[0], n1 = m.n[1] * Ts;
                M[at] = v;
                M[at][at] = M[at][at] - d1;
                for (R& e : y) e = n0 * e;
                y[at] = y[at] + (n1 - n0 * d1);
            } else {  // x1' = x2,  x2' = v - d2 x1 - d1 x2,   y = n0 v + (n2 - n0 d2) x1 + (n1 - n0 d1) x2
                const R d1 = m.d[1] * Ts, d2 = m.d[2] * Ts * Ts, n0 = m.n[0], n1 = m.n[1] * Ts, n2 = m.n[2] * Ts * Ts;
                M[at][at + 1] = R(1);
                M[at + 1] = v;
                M[at + 1][at] = M[at + 1][at] - d2;
                M[at + 1][at + 1] = M[at + 1][at + 1] - d1;
                for (R& e : y) e = n0 * e;
                y[at] = y[at] + (n2 - n0 * d2);
                y[at + 1] = y[at + 1] + (n1 - n0 * d1);
            }
            at += static_cast<std::size_t>(m.order);
        }
        transition_ = exponential(M);
        output_ = y;
        x_.assign(n + 1, R(0));
    }

    R velocity() const {  // p >= 1: the torque of this sample does not reach it
        R w = R(0);
        for (std::size_t i = 0; i + 1 < x_.size(); ++i) w = w + output_[i] * x_[i];
        return w;
    }
    void hold(R torque) {
        x_.back() = K_ * torque;
        std::vector<R> next(x_.size(), R(0));
        for (std::size_t i = 0; i < x_.size(); ++i)
            for (std::size_t j = 0; j < x_.size(); ++j) next[i] = next[i] + transition_[i][j] * x_[j];
        x_ = next;
    }

private:
    R K_;  // kept outside: it can be large, and a large matrix loses digits
    Matrix<R> transition_;
    std::vector<R> output_, x_;
};

template <class R>
Response<R> run_sampled(const System<R>& system, std::span<const double> command, double Ts, const Loop& loop) {
    HeldPlant<R> plant(system, Ts);
    Regulator<R> pi(loop, Ts);
    Response<R> out;
    for (const double r : command) {
        const R w = plant.velocity(), e = R(r) - w, u = pi.torque(e);
        pi.advance(e);
        plant.hold(u);
        out.velocity.push_back(w);
        out.torque.push_back(u);
    }
    return out;
}

template <class R>
Response<R> run_open(const System<R>& system, std::span<const double> torque, double Ts) {
    HeldPlant<R> plant(system, Ts);
    Response<R> out;
    for (const double u : torque) {
        out.velocity.push_back(plant.velocity());
        out.torque.push_back(R(u));
        plant.hold(R(u));
    }
    return out;
}

template <class R>
Response<R> run(const System<R>& system, std::span<const double> input, double Ts, const Loop& loop) {
    if (loop.kind == LoopKind::open) return run_open(system, input, Ts);
    if (loop.kind == LoopKind::sampled) return run_sampled(system, input, Ts, loop);
    return run_continuous(system, input, Ts, loop);
}

}  // namespace gaident::reference
