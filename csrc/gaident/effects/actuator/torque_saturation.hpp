// The amplifier's limit: clip(u, -limit, limit).
#pragma once

#include "../effect.hpp"

namespace gaident {

struct TorqueSaturation {
    static constexpr EffectParameter parameters[] = {{"limit", "N m", infinite, 0.0, infinite, true}};
    static constexpr EffectInfo info{
        .name = "torque_saturation",
        .place = Place::actuator,
        .meaning = "the actuator gives no more {torque} than this",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::actuator;

    template <class R>
    struct Coefficients {
        R limit;
    };
    static constexpr Pace pace = Pace::sample;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.limit = p[0]; }

    template <class R>
    [[gnu::always_inline]] static R actuator(const Coefficients<R>& c, R u) {
        return clamp(u, -c.limit, c.limit);
    }
};

}  // namespace gaident
