// The velocity as the difference of the angle over k samples T of the controller, the mean velocity over them:
//
//     y(n) = (theta(n) - theta(n-k))/(k T) = 1/k (m_0 + m_1 + ... + m_(k-1)),   m_i the mean velocity over the sample i samples ago
//
// m of the substeps' means.
// Within a sample, where the continuous loop reads it, the difference slides: of the sample that leaves it a part p_i is left,
// and of the sample that has begun, j of m substeps are there,
//
//     y = 1/k (sum of the substeps' means/m + sum_i p_i (m_i + (1 - p_i)/4 (m_(i-1) - m_(i+1)))),   p_i = clamp(k - j/m - i, 0, 1)
//
// the angle a parabola through the samples beside. It is the first formula where j = 0 and k is a whole number.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct VelocityDifference {
    static constexpr int most = 16;  // samples, whose means are kept
    static constexpr EffectParameter parameters[] = {{"samples", "1", 0.0, 0.0, most}};
    static constexpr EffectInfo info{
        .name = "velocity_difference",
        .place = Place::sensor,
        .meaning = "the velocity is the difference of the {angle} over some samples of the controller",
        .parameters = parameters,
        .allowed = [](const double* p) { return p[0] == 0.0 || p[0] >= 1.0; },
        .relation = "samples must be 1 or more (0: no difference is taken)",
    };
    static constexpr Hooks hooks = Hooks::sensor_dynamics | Hooks::begin;

    template <class R>
    struct Coefficients {
        R samples, per_samples;  // k, 1/k
        R step, last;            // h/T; m - 1/2 substeps, beyond which a sample ends
    };
    template <class R>
    struct State {
        R output, mean[most], sum, w;  // rad/s
        R steps;                       // how many substeps of the sample are behind
    };
    static constexpr bool apart = true;
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor& made, Coefficients<double>& c) {
        c = {p[0], 1.0 / p[0], 1.0 / made.per_sample, made.per_sample - 0.5};
    }
    template <class R>
    static void begin(const Coefficients<R>&, State<R>& s, const Beginning<R>& start) {
        s.output = s.w = start.velocity;
        for (R& mean : s.mean) mean = start.velocity;
    }

    template <class R>
    [[gnu::noinline]] static R sensor_dynamics(const Coefficients<R>& c, State<R>& s, R w_next, R bend) {
        s.steps = s.steps + R(1.0);
        s.sum = fma(c.step, fma(s.w + w_next, R(0.5), bend), s.sum);
        s.w = w_next;
        if (all_above(s.steps, c.last)) {
            // Written out, so that no call of the C library takes its place: how many instructions that has depends on the processor.
#pragma GCC unroll 16
            for (int i = most - 1; i > 0; --i) s.mean[i] = s.mean[i - 1];
            s.mean[0] = s.sum;
            s.sum = s.steps = R(0.0);
        }
        const R left = fnma(c.step, s.steps, c.samples);
        R all = s.sum;
        for (int i = 0; i < most; ++i) {
            const R part = minimum(maximum(left - R(i), R(0.0)), R(1.0));
            const R slope = s.mean[i > 0 ? i - 1 : 0] - s.mean[i + 1 < most ? i + 1 : i];
            all = fma(part, fma((R(1.0) - part) * R(0.25), slope, s.mean[i]), all);
        }
        return s.output = all * c.per_samples;
    }
};

}  // namespace gaident
