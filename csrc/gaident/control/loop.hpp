// The closed loop sample by sample, controller and plant apart: what the one difference equation cannot do, because
// something in the loop is not linear. Here that is the controller's own limits; effects join at their places.
#pragma once

#include "closed_loop.hpp"

namespace gaident {

template <class R, int N>
struct SteppedLoop {
    ControllerState<R> pi;

    // One sample: reads the plant's state, solves for torque u and velocity y of this sample, advances both.
    //
    // With direct feed-through b0 (bilinear plant) the velocity answers the torque within the sample:
    //     y = h + b0 u,   e = r - y,   u = clamp(kp e + clamp(s + g e, Imax), umax).
    // u falls as e falls and e falls as u rises, so the solution is unique; where a clamp acts the torque is known and
    // the rest follows. Without feed-through (held plant, b0 = 0) the same lines reduce to the plain digital controller.
    [[gnu::always_inline]] R step(int order, const R* a, const R* b, R* x, R r, R& u) {
        const R h = r - x[0], one = R(1.0);
        const R free_error = fnma(b[0], pi.s, h) / fma(b[0], pi.kp + pi.g, one);
        const R I_free = fma(pi.g, free_error, pi.s);
        const R I = clamp(I_free, -pi.integrator_limit, pi.integrator_limit);
        // Where I is clamped it is a constant, and the loop closes over kp alone; where not, both lines agree.
        const R clamped_error = fnma(b[0], I, h) / fma(b[0], pi.kp, one);
        u = clamp(fma(pi.kp, clamped_error, I), -pi.torque_limit, pi.torque_limit);
        const R e = fnma(b[0], u, h);
        pi.s = fma(pi.g, e, clamp(fma(pi.g, e, pi.s), -pi.integrator_limit, pi.integrator_limit));
        const int n = N >= 0 ? N : order;
        const R y = fma(b[0], u, x[0]);
        for (int i = 0; i + 1 < n; ++i) x[i] = fnma(a[i], y, fma(b[i + 1], u, x[i] + x[i + 1]));
        if (n > 0) x[n - 1] = fnma(a[n - 1], y, fma(b[n], u, x[n - 1]));
        return y;
    }
};

}  // namespace gaident
