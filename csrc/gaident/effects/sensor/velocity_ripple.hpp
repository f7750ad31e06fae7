// An angle sensor with a periodic error a of order n, as its velocity shows it: w (1 + a n cos(n theta + phase)).
#pragma once

#include "../../numeric/elementary.hpp"
#include "../effect.hpp"

namespace gaident {

struct VelocityRipple {
    static constexpr EffectInfo info{"velocity_ripple",
                                     Place::sensor,
                                     "periodic error of the angle sensor, n times per turn",
                                     {{"amplitude", "rad", 0.0, 0.0}, {"order", "1/turn", any_value, 1.0}, {"phase", "rad"}}};

    template <class R>
    [[gnu::always_inline]] static R seen(R a, R n, R phase, R theta, R w) {
        return w * (R(1.0) + (a * n) * cosine(n * theta + phase));
    }
};

}  // namespace gaident
