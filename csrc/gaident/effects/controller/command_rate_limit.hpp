// The command is followed with at most this slope: r'(n) = r'(n-1) + clip(r(n) - r'(n-1), -rate T, rate T).
#pragma once

#include "../../control/slope_limit.hpp"
#include "../effect.hpp"

namespace gaident {

struct CommandRateLimit {
    static constexpr EffectParameter parameters[] = {{"rate", "rad/s^2", infinite, 0.0, infinite, true}};
    static constexpr EffectInfo info{
        .name = "command_rate_limit",
        .place = Place::controller,
        .meaning = "the command is followed with at most this slope",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::command | Hooks::begin;

    template <class R>
    struct Coefficients {
        R step;  // rate T [rad/s]
    };
    template <class R>
    struct State {
        R before;  // rad/s
    };
    static constexpr Pace pace = Pace::sample;
    static void prepare(const double* p, const PreparedFor& time, Coefficients<double>& c) { c.step = p[0] * time.hold; }
    template <class R>
    static void begin(const Coefficients<R>&, State<R>& s, const Beginning<R>& start) {
        s.before = start.command;
    }

    template <class R>
    [[gnu::always_inline]] static R command(const Coefficients<R>& c, State<R>& s, R r) {
        return s.before = follow(c.step, r, s.before);
    }
};

}  // namespace gaident
