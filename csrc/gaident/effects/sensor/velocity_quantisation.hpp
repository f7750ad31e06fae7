// A velocity that comes in steps: round(w/step) step.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct VelocityQuantisation {
    static constexpr EffectParameter parameters[] = {{"step", "rad/s", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "velocity_quantisation",
        .place = Place::sensor,
        .meaning = "the measured velocity comes in steps (noise)",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::reading;

    template <class R>
    struct Coefficients {
        R step;
    };
    static constexpr Pace pace = Pace::sample;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.step = p[0]; }

    template <class R>
    [[gnu::always_inline]] static R reading(const Coefficients<R>& c, R w) {
        return nearest(w / c.step) * c.step;
    }
};

}  // namespace gaident
