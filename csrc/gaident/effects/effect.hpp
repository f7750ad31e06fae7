// What an effect is: a name, a place in the loop, up to four parameters with units, and one line of meaning. Neutral parameters make it
// the identity. Its formula stands in its own header; effects do not know one another, the loop asks each at its place.
#pragma once

#include <limits>

namespace gaident {

enum class Place { shaft, coupling, actuator, controller, sensor, plant, record };

inline constexpr double infinite = std::numeric_limits<double>::infinity();
inline constexpr double any_value = std::numeric_limits<double>::quiet_NaN();

struct EffectParameter {
    const char* name = nullptr;
    const char* unit = "";
    double neutral = any_value;  // the effect is the identity where every parameter that has a neutral value has it
    double lowest = -infinite, highest = infinite;
    bool above_lowest = false;  // the lowest value itself is excluded
};

inline constexpr int max_effect_parameters = 4;

struct EffectInfo {
    const char* name;
    Place place;
    const char* meaning;
    EffectParameter parameter[max_effect_parameters];
    bool simulated = true;
    bool needs_two_masses = false;
    bool (*identity)(const double*) = nullptr;  // where being neutral is a relation between parameters
    bool (*allowed)(const double*) = nullptr;   // a relation that parameters have to meet,
    const char* relation = "";                  // in words

    constexpr int parameters() const {
        int n = 0;
        while (n < max_effect_parameters && parameter[n].name != nullptr) ++n;
        return n;
    }

    constexpr bool neutral(const double* p) const {
        if (identity != nullptr) return identity(p);
        for (int i = 0; i < parameters(); ++i) {
            const double value = parameter[i].neutral;
            if (value == value && p[i] != value) return false;
        }
        return true;
    }
};

// What friction-like effects add up to, as torques against the motion:
//
//     w > 0:  level_positive + viscous_positive w + drag w^2,   w < 0: level_negative + viscous_negative abs(w) + drag w^2
template <class R>
struct FrictionLaw {
    R level_positive = R(0.0), level_negative = R(0.0);      // N m
    R viscous_positive = R(0.0), viscous_negative = R(0.0);  // N m s/rad
    R drag = R(0.0);                                         // N m s^2/rad^2
    R more_at_rest = R(0.0);                                 // what the levels at w = 0 have more, N m
};

}  // namespace gaident
