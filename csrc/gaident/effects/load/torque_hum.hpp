// A torque that alternates in time whatever the shaft does: A sin(2 pi f t + phase), t from the record's start.
// Its mean over a substep h is the sine in the middle of it times sin(x)/x, x = pi f h.
#pragma once

#include "../effect.hpp"

#include <cmath>

namespace gaident {

struct TorqueHum {
    static constexpr EffectParameter parameters[] = {
        {"amplitude", "N m", 0.0, 0.0},
        {"frequency", "Hz", any_value, 0.0, infinite, true},
        {"phase", "rad"},
    };
    static constexpr EffectInfo info{
        .name = "torque_hum",
        .place = Place::shaft,
        .meaning = "{torque} of one frequency in time: the supply, a fan, a neighbour",
        .parameters = parameters,
        .remark = "time from the start of the record",
    };
    static constexpr Hooks hooks = Hooks::torque_of_time;

    template <class R>
    struct Coefficients {
        R mean, turns, phase;  // N m, rad/s, rad
    };
    static constexpr Pace pace = Pace::fine;
    static void prepare(const double* p, const PreparedFor& made, Coefficients<double>& c) {
        constexpr double pi = 3.14159265358979323846;
        const double x = pi * p[1] * made.step;
        c = {p[0] * (x > 0.0 ? std::sin(x) / x : 1.0), 2.0 * pi * p[1], p[2]};
    }

    template <class R>
    [[gnu::always_inline]] static R torque_of_time(const Coefficients<R>& c, R t) {
        return -c.mean * sine(fma(c.turns, t, c.phase));
    }
};

}  // namespace gaident
