// One more resonance of the mechanism, linear, 1 at standstill:
//
//     (wp/wz)^2 (s^2 + 2 zz wz s + wz^2)/(s^2 + 2 zp wp s + wp^2)
#pragma once

#include "../../plant/factors.hpp"
#include "../effect.hpp"

#include <stdexcept>

namespace gaident {

struct ExtraResonance {
    static constexpr EffectParameter parameters[] = {
        {"frequency", "rad/s", any_value, 0.0, infinite, true},
        {"damping", "1", any_value, 0.0},
        {"zero_frequency", "rad/s", any_value, 0.0, infinite, true},
        {"zero_damping", "1", any_value, 0.0},
    };
    static constexpr EffectInfo info{
        .name = "extra_resonance",
        .place = Place::plant,
        .meaning = "one more resonance of the mechanism, with gain 1 at standstill",
        .parameters = parameters,
        .identity = [](const double* p) { return p[0] == p[2] && p[1] == p[3]; },
    };
    static constexpr Hooks hooks = Hooks::plant;
    static constexpr Pace pace = Pace::sample;

    static Factors<double> plant(const double* p, Factors<double> g) {
        const double wp = p[0], zp = p[1], wz = p[2], zz = p[3];
        if (g.structure.poles() + 2 > max_plant_order || g.structure.q + 2 > max_plant_order / 2)
            throw std::invalid_argument("extra_resonance: the model already has as many poles or zeros as a model can have");
        g.pole_pair[g.structure.pole_pairs()] = {2.0 * zp * wp, wp * wp};
        g.zero_pair[g.structure.zero_pairs()] = {2.0 * zz * wz, wz * wz};
        g.structure.q += 2;
        g.gain *= (wp / wz) * (wp / wz);
        return g;
    }
};

}  // namespace gaident
