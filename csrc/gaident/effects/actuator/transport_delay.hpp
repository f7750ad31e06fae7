// u(t - delay), any fraction of a sample. A held torque delayed is still piecewise constant: over the substep [t, t + h] its mean is
//
//     (1 - v) u(k) + v u(k+1),   x = (t - delay)/T,  k = floor(x),  v = max(0, (x - k) + h/T - 1) T/h
//
// with T the time each torque is held.
#pragma once

#include "../effect.hpp"

namespace gaident {

inline constexpr double longest_delay = 1.0;  // s

struct TransportDelay {
    static constexpr EffectInfo info{"transport_delay",
                                     Place::actuator,
                                     "the torque acts later than it was commanded",
                                     {{"delay", "s", 0.0, 0.0, longest_delay}}};

    // For substep j of m: `back` = -k counted from the present value, `share` = v.
    static void mean(double delay, double hold, int j, int m, int& back, double& share) {
        const double x = static_cast<double>(j) / m - delay / hold;
        int k = static_cast<int>(x);
        if (static_cast<double>(k) > x) --k;
        const double over = (x - static_cast<double>(k)) * m + 1.0 - m;
        back = -k;
        share = over > 0.0 ? over : 0.0;
        // Rounding may put the present substep a hair before the present value, or ask for one that is not there yet.
        if (back <= 0) {
            back = 0;
            share = 0.0;
        }
    }
};

}  // namespace gaident
