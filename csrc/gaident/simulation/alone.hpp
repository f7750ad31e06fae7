// One candidate over one record, in any arithmetic: velocity and torque.
#pragma once

#include "../control/loop.hpp"

#include <cstddef>

namespace gaident {

// A response with its state, and what closes the loop around it.
template <class R>
struct AloneRun {
    LoopKind kind;
    bool limited;  // the response is the plant's, and controller and plant are stepped
    int order;
    R a[max_loop_order], b[max_loop_order + 1], x[max_loop_order];
    ControllerState<R> controller;
};

// In open loop the torque is the input.
template <class R>
[[gnu::always_inline]] inline void run_alone(AloneRun<R>& run, const double* input, std::size_t n, auto&& number, auto&& value,
                                             double* velocity, double* torque) {
    if (run.limited) {
        SteppedLoop<R, -1> stepped{run.controller};
        for (std::size_t k = 0; k < n; ++k) {
            R u;
            velocity[k] = value(stepped.step(run.order, run.a, run.b, run.x, number(input[k]), u));
            torque[k] = value(u);
        }
        run.controller = stepped.pi;
        return;
    }
    for (std::size_t k = 0; k < n; ++k) {
        const R r = number(input[k]), y = recurrence_step<R, -1>(run.order, run.a, run.b, run.x, r);
        velocity[k] = value(y);
        torque[k] = run.kind == LoopKind::open ? input[k] : value(run.controller.step(r - y));
    }
}

}  // namespace gaident
