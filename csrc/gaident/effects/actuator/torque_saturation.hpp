// The amplifier's limit: clip(u, -limit, limit).
#pragma once

#include "../effect.hpp"

namespace gaident {

struct TorqueSaturation {
    static constexpr EffectInfo info{"torque_saturation",
                                     Place::actuator,
                                     "the actuator gives no more torque than this",
                                     {{"limit", "N m", infinite, 0.0, infinite, true}}};
};

}  // namespace gaident
