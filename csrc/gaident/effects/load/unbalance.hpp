// Gravity on an eccentric load: -A sin(theta + phase).
#pragma once

#include "../effect.hpp"

namespace gaident {

struct Unbalance {
    static constexpr EffectParameter parameters[] = {{"amplitude", "N m", 0.0, 0.0}, {"phase", "rad"}};
    static constexpr EffectInfo info{
        .name = "unbalance",
        .place = Place::shaft,
        .meaning = "load {once per turn}: gravity on an eccentric load",
        .parameters = parameters,
        .turns = true,
    };
    static constexpr Hooks hooks = Hooks::torque | Hooks::substeps;

    template <class R>
    struct Coefficients {
        R amplitude, phase;
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c = {p[0], p[1]}; }
    static double substeps(const double*, const Circumstances& at) { return at.for_turns(1.0); }

    template <class R>
    [[gnu::always_inline]] static R torque(const Coefficients<R>& c, R theta) {
        return c.amplitude * sine(theta + c.phase);
    }
};

}  // namespace gaident
