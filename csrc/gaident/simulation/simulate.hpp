// One model, one record: velocity and torque, in double or in float.
#pragma once

#include "batch.hpp"
#include "../numeric/denormals.hpp"
#include "../numeric/float_pair.hpp"
#include "../plant/roots.hpp"

namespace gaident {

// Runs the model over `input`; writes velocity and torque (in open loop the torque is the input).
// Coefficients are computed in double and rounded to R, as the genetic search does.
// `start`: see prepare(); null means rest. Throws Stopped soon after `stop` is set, where there is one.
template <class R>
void simulate(const Factors<double>& g, std::span<const double> input, double sample_time, const Loop& loop, const double* start,
              std::span<double> velocity, std::span<double> torque, const std::atomic<bool>* stop = nullptr) {
    const FlushDenormals flush;
    Record record;
    record.input = input;
    record.output = input;
    record.sample_time = sample_time;
    const Prepared c = prepare(g, record, loop, start);
    AloneRun<R> run{loop.kind, loop.limited(), c.response.order, {}, {}, {}, {loop.controller, Clock{sample_time}}};
    for (int i = 0; i < run.order; ++i) run.a[i] = static_cast<R>(c.response.a[i]);
    for (int i = 0; i <= run.order; ++i) run.b[i] = static_cast<R>(c.response.b[i]);
    for (int i = 0; i < max_loop_order; ++i) run.x[i] = static_cast<R>(c.x[i]);
    run.controller.s = static_cast<R>(c.s);
    for (std::size_t k = 0; k < input.size(); k += samples_between_stops) {
        stop_if_asked(stop);
        const std::size_t n = std::min(input.size() - k, samples_between_stops);
        const double* const r = input.data() + k;
        double *const w = velocity.data() + k, *const u = torque.data() + k;
        if constexpr (std::same_as<R, double>) best_kernels().in_double.alone(run, r, n, w, u);
        else if constexpr (std::same_as<R, float>) best_kernels().in_float.alone(run, r, n, w, u);
        else
            run_alone(
                run, r, n, [](double x) { return static_cast<R>(x); }, [](const R& x) { return static_cast<double>(x); }, w, u);
    }
}

// In 32-bit arithmetic: plain floats where they represent the loop's polynomial, pairs of floats where they do not, and where a
// limit keeps controller and plant apart, so that a torque rounded to 24 bits would go through the plant.
inline void simulate_in_float(const Factors<double>& g, std::span<const double> input, double sample_time, const Loop& loop,
                              const double* start, std::span<double> velocity, std::span<double> torque,
                              const std::atomic<bool>* stop = nullptr) {
    Record record;
    record.input = record.output = input;
    record.sample_time = sample_time;
    const Delta<double> h = prepare(g, record, loop, start).response;
    if (!loop.limited() && float_suffices(h.order, [&](int i) { return h.a[i]; }))
        simulate<float>(g, input, sample_time, loop, start, velocity, torque, stop);
    else simulate<FloatPair>(g, input, sample_time, loop, start, velocity, torque, stop);
}

// Equation (7) in powers of z^-1: w(n) = sum_0^N alpha_i r(n-i) + sum_1^N beta_i w(n-i), by expanding delta = z - 1.
template <class R>
void powers_of_z(const Delta<R>& h, R* alpha, R* beta) {
    R numerator[max_loop_order + 1], denominator[max_loop_order + 1];
    denominator[0] = R(1.0);
    for (int i = 0; i < h.order; ++i) denominator[i + 1] = h.a[i];
    for (int i = 0; i <= h.order; ++i) numerator[i] = h.b[i];
    // Taylor shift by repeated synthetic division with z - 1.
    const auto shift = [&](R* c) {
        for (int last = h.order; last > 0; --last)
            for (int i = 1; i <= last; ++i) c[i] = c[i] - c[i - 1];
    };
    shift(numerator);
    shift(denominator);
    for (int i = 0; i <= h.order; ++i) alpha[i] = numerator[i];
    for (int i = 0; i < h.order; ++i) beta[i] = -denominator[i + 1];
}

}  // namespace gaident
