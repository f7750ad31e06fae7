// Dry friction that changes as the drive warms up: -Tc (1 + rate t) sign(w), t from the record's start; never below zero.
#pragma once

#include "../effect.hpp"
#include "law.hpp"

namespace gaident {

struct FrictionDrift {
    static constexpr EffectParameter parameters[] = {{"torque", "N m", 0.0, 0.0}, {"rate", "1/s"}};
    static constexpr EffectInfo info{
        .name = "friction_drift",
        .place = Place::shaft,
        .meaning = "dry friction that grows or falls with time",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::level;

    template <class R>
    struct Coefficients {
        R torque, rate;
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[0], p[1]}; }

    template <class R>
    [[gnu::always_inline]] static R level(const Coefficients<R>& c, R t) {
        return maximum(c.torque * fma(c.rate, t, R(1.0)), R(0.0));
    }
};

}  // namespace gaident
