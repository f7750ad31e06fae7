// The linear closed loop as ONE difference equation (equation 7), in delta form: nearly all of the time of a genetic run is spent
// here.
//
// With the plant B/A and the controller ((kp + ki Ts/2) delta + ki Ts)/delta,
//
//     N = (PI numerator) B,   D = delta A,   w/w* = N/(D + N)        (the algebraic loop, if any, is solved by dividing by
//                                                                     the leading coefficient of D + N)
#pragma once

#include "controller.hpp"
#include "../numeric/unrolled.hpp"

#include <type_traits>

namespace gaident {

template <class R, int N>
    Delta < R,
    N<0 ? -1 : N + 1> close_loop(const Delta<R, N>& plant, const Controller& c, const Clock& clock) {
    const R c1 = R(c.kp + 0.5 * c.ki * clock.period), c0 = R(c.ki * clock.period);
    const int n = N >= 0 ? N : plant.order;
    Delta < R, N<0 ? -1 : N + 1> loop;
    loop.order = n + 1;
    const R scale = R(1.0) / fma(c1, plant.b[0], R(1.0));
    for (int i = 0; i <= n + 1; ++i) {
        const R head = i <= n ? R(c1 * plant.b[i]) : R(0.0);
        const R numerator = i > 0 ? R(fma(c0, plant.b[i - 1], head)) : head;
        loop.b[i] = numerator * scale;
        if (i > 0) loop.a[i - 1] = ((i <= n ? plant.a[i - 1] : R(0.0)) + numerator) * scale;
    }
    return loop;
}

// The recurrence, in observer form; every arithmetic runs these lines:
//
//     y(n)       = x[0](n) + b[0] r(n)
//     x[i](n+1)  = x[i](n) + x[i+1](n) + b[i+1] r(n) - a[i] y(n),   x[N] = 0
//
// y enters last, by one fused operation: what does not depend on it is ready before it is, which shortens the chain from one sample to
// the next.
// `N` is the order when known at compile time, so that the state lives in registers; -1 otherwise.
// Without input (r = 0) the terms in b are left out.
// Coefficients C and states X are of the signals' own type R, but for a drive's arithmetic that keeps them in memory words and
// computes in wider registers (c30.hpp, fixed.hpp).
template <class R, int N, bool driven = true, class C = R, class X = R>
[[gnu::always_inline]] inline R recurrence_step(int order, const C* a, const std::type_identity_t<C>* b, X* x, R r) {
    const int n = N >= 0 ? N : order;
    const auto with_input = [&](const auto& sum, int i) [[gnu::always_inline]] {
        if constexpr (driven) return fma(b[i], r, sum);
        else return sum;
    };
    const R y = with_input(x[0], 0);
    constexpr int before_last = N < 1 ? N : N - 1;
    unrolled<before_last>(n - 1, [&](int i) [[gnu::always_inline]] { x[i] = fnma(a[i], y, with_input(x[i] + x[i + 1], i + 1)); });
    if (n > 0) x[n - 1] = fnma(a[n - 1], y, with_input(x[n - 1], n));
    return y;
}

// The same with two inputs r and s, that of s with the coefficients c.
template <class R, int N>
[[gnu::always_inline]] inline R recurrence_step(int order, const R* a, const R* b, const R* c, R* x, R r, R s) {
    const int n = N >= 0 ? N : order;
    const auto with_inputs = [&](const R& sum, int i) [[gnu::always_inline]] { return fma(c[i], s, fma(b[i], r, sum)); };
    const R y = with_inputs(x[0], 0);
    constexpr int before_last = N < 1 ? N : N - 1;
    unrolled<before_last>(n - 1,
                          [&](int i) [[gnu::always_inline]] { x[i] = fnma(a[i], y, with_inputs(x[i] + x[i + 1], i + 1)); });
    if (n > 0) x[n - 1] = fnma(a[n - 1], y, with_inputs(x[n - 1], n));
    return y;
}

// Under a constant command r a PI loop rests at y = r, since its a[N-1] is its b[N], and its states at x[i] = at_rest(i) r.
// Deviations from that rest obey the recurrence without input, which is nearly half the work.
template <class A, class B>
[[gnu::always_inline]] inline auto at_rest(int i, const A& a, const B& b) {
    using R = std::remove_cvref_t<decltype(b(0))>;
    return i == 0 ? R(R(1.0) - b(0)) : R(a(i - 1) - b(i));
}

// A loop at constant velocity y0 under constant input r0, the state a record that starts in steady motion starts from.
template <class R>
void steady_state(const Delta<R>& h, double y0, double r0, R* x) {
    const R y = R(y0), r = R(r0);
    for (int i = 0; i < h.order; ++i) x[i] = i == 0 ? y - h.b[0] * r : h.a[i - 1] * y - h.b[i] * r;
}

// From the plant's states (observer form) and the controller's stored torque s to the states of the closed loop's difference
// equation:
// (D + N) Y = N R + (delta + 1) (B s + delta X),  X = x[0] delta^(n-1) + ... + x[n-1].
template <class R>
void loop_state(const Delta<R>& plant, const Controller& c, const Clock& clock, const R* x, R s, R* out) {
    const R lead = R(1.0) + R(c.kp + 0.5 * c.ki * clock.period) * plant.b[0];
    for (int i = 0; i <= plant.order; ++i) {
        const R own = i < plant.order ? x[i] : R(0.0);
        out[i] = (own + plant.b[i] * s) / lead;
    }
}

}  // namespace gaident
