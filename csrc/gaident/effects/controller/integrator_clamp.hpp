// The controller's integrator is limited: abs(I) <= limit, after each update.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct IntegratorClamp {
    static constexpr EffectInfo info{"integrator_clamp",
                                     Place::controller,
                                     "the controller's integrator is limited",
                                     {{"limit", "N m", infinite, 0.0, infinite, true}}};
};

}  // namespace gaident
