// Small torques do nothing: 0 for abs(u) <= width, else u - width sign(u) = u - clip(u, -width, width).
#pragma once

#include "../effect.hpp"

namespace gaident {

struct TorqueDeadBand {
    static constexpr EffectParameter parameters[] = {{"width", "N m", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "torque_dead_band",
        .place = Place::actuator,
        .meaning = "{torques} below this (half) width do nothing, larger ones lose it",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::actuator | Hooks::substeps;

    template <class R>
    struct Coefficients {
        R width;
    };
    static constexpr Pace pace = Pace::sample;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.width = p[0]; }
    // In the continuous loop of one mass the torque crosses the band between the controller's steps.
    static double substeps(const double*, const Circumstances& at) {
        return at.loop.kind == LoopKind::continuous && at.plant.structure.p == 1 ? 16.0 : 1.0;
    }

    template <class R>
    [[gnu::always_inline]] static R actuator(const Coefficients<R>& c, R u) {
        return u - clamp(u, -c.width, c.width);
    }
};

}  // namespace gaident
