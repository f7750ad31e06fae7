// The velocity at the end of a substep under set-valued friction.
//
//     w+ = w_free - beta f,   beta > 0: what a unit torque held over the substep does to w+
//
// f is the mean friction over the substep, with the motion taken as uniformly accelerated: where it keeps its direction
//
//     f = C + B (w + w+)/2 + Q abs(w) w+                                                         (second order, no ringing)
//
// and where it would reverse, it stops after the share of the substep that the deceleration asks for.
// The rest it spends moving off the other way, or at rest.
// There w+ = 0 exactly, as long as the other torques stay below the level.
// Directions are folded, so that w >= 0.
#pragma once

#include "../../numeric/elementary.hpp"

namespace gaident {

// What friction-like effects add up to, as torques against the motion:
//
//     w > 0:  level_positive + viscous_positive w + drag w^2,   w < 0: level_negative + viscous_negative abs(w) + drag w^2
template <class R>
struct FrictionLaw {
    R level_positive = R(0.0), level_negative = R(0.0);      // N m
    R viscous_positive = R(0.0), viscous_negative = R(0.0);  // N m s/rad
    R drag = R(0.0);                                         // N m s^2/rad^2
    R more_at_rest = R(0.0);                                 // what the levels at w = 0 have more, N m
    bool steep = false;                                      // whether there is viscous friction or drag at all
};

// The equation of one substep, w+ = w_free - beta f, as friction effects change it one after the other.
template <class R>
struct FrictionStep {
    R h;  // s
    R w;  // where the substep begins [rad/s]
    R w_free, beta;
    FrictionLaw<R> law;
};

template <class R>
[[gnu::always_inline]] inline R velocity_under_friction(const FrictionLaw<R>& law, R w, R w_free, R beta) {
    const R zero = R(0.0), one = R(1.0), half = R(0.5);
    const R speed = absolute(w);
    // w+ where the motion keeps its direction d: C and B are those of d, d C = +-C
    const auto onward = [&](R d) __attribute__((always_inline)) {
        const R kept = fnma(beta, greater(d, zero, law.level_positive, zero - law.level_negative), w_free);
        if (!law.steep) return kept;
        const R B = greater(d, zero, law.viscous_positive, law.viscous_negative) * half;
        return fnma(beta * B, w, kept) / fma(beta, fma(law.drag, speed, B), one);
    };
    // A short cut past the stop, where all go on as they went; no other result. Nothing is asked of w_free before w+ is there.
    const R kept_as_w = onward(w);
    if (all_above(w * kept_as_w, zero)) return kept_as_w;
    const R direction = greater(speed, zero, w, w_free);  // from rest, where the other torques push
    const R kept = onward(direction), sign = greater(direction, zero, one, -one), ahead = sign * kept;
    const R C_back = greater(direction, zero, law.level_negative, law.level_positive);
    const R rest = ahead / ((ahead - speed) - R(1e-300));  // share of the substep after the stop; 0/0 becomes 0
    const R back = rest * minimum(fma(beta, C_back + law.more_at_rest, sign * (w_free - w)), zero);
    return greater(ahead, zero, kept, sign * back);
}

}  // namespace gaident
