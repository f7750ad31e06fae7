// The command is followed with at most this slope: r'(n) = r'(n-1) + clip(r(n) - r'(n-1), -rate T, rate T).
#pragma once

#include "../../control/slope_limit.hpp"
#include "../effect.hpp"

namespace gaident {

struct CommandRateLimit {
    static constexpr EffectInfo info{"command_rate_limit",
                                     Place::controller,
                                     "the command is followed with at most this slope",
                                     {{"rate", "rad/s^2", infinite, 0.0, infinite, true}}};

    // `step` = rate T
    template <class R>
    [[gnu::always_inline]] static R follow(R step, R r, R before) {
        return gaident::follow(step, r, before);
    }
};

}  // namespace gaident
