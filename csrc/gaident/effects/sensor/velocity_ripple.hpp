// An angle sensor with a periodic error a of order n, as its velocity shows it: w (1 + a n cos(n theta + phase)).
#pragma once

#include "../effect.hpp"

namespace gaident {

struct VelocityRipple {
    static constexpr EffectParameter parameters[] = {
        {"amplitude", "rad", 0.0, 0.0},
        {"order", "1/turn", any_value, 1.0},
        {"phase", "rad"},
    };
    static constexpr EffectInfo info{
        .name = "velocity_ripple",
        .place = Place::sensor,
        .meaning = "periodic error of the {angle} sensor, n times {per turn}",
        .parameters = parameters,
        .turns = true,
    };
    static constexpr Hooks hooks = Hooks::sensor;

    template <class R>
    struct Coefficients {
        R amplitude, order, phase;
    };
    static constexpr Pace pace = Pace::sample;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[0], p[1], p[2]}; }

    template <class R>
    [[gnu::always_inline]] static R sensor(const Coefficients<R>& c, R theta, R w) {
        return w * with_wave(c, theta, R(1.0));
    }
    // What the velocity is multiplied by, with one wave more.
    template <class R>
    [[gnu::always_inline]] static R with_wave(const Coefficients<R>& c, R theta, R sum) {
        return fma(c.amplitude * c.order, cosine(fma(c.order, theta, c.phase)), sum);
    }
};

}  // namespace gaident
