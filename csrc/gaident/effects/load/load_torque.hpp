// A constant load: -T.
#pragma once

#include "../effect.hpp"

namespace gaident {

struct LoadTorque {
    static constexpr EffectInfo info{
        "load_torque", Place::shaft, "constant load; positive brakes positive rotation", {{"torque", "N m", 0.0}}};
};

}  // namespace gaident
