// A constant load: -T.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct LoadTorque {
    static constexpr EffectParameter parameters[] = {{"torque", "N m", 0.0}};
    static constexpr EffectInfo info{
        .name = "load_torque",
        .place = Place::shaft,
        .meaning = "constant load",
        .parameters = parameters,
        .remark = "positive brakes positive {rotation}",
    };
    static constexpr Hooks hooks = Hooks::torque;

    template <class R>
    struct Coefficients {
        R load;
    };
    static constexpr Pace pace = Pace::sample;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.load = p[0]; }

    template <class R>
    [[gnu::always_inline]] static R torque(const Coefficients<R>& c, R) {
        return c.load;
    }
};

}  // namespace gaident
