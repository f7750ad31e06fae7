// Where a search looks for a plant: the ranges of its order, its roots and its gain.
#pragma once

namespace gaident {

struct Range {
    double lo = 0.0, hi = 0.0;
};

// Search ranges in rad/s (gain: the paper's K), as the user sees them.
struct SearchRanges {
    Range gain{1e3, 2e4};
    Range real{0.0, 60.0};
    Range imaginary{0.0, 250.0};
    int p_min = 0, p_max = 3, q_min = 0, q_max = 3;
    int bits = 10;  // per number
    // K has the dimension of 1/J times (rad/s)^(p-1).
    // `gain` is the range at p = 1; at other p it counts in units of gain_scale^(p-1) [rad/s].
    // 1 is the paper: one range whatever p.
    double gain_scale = 1.0;

    constexpr double gain_unit(int p) const {
        double unit = p == 0 ? 1.0 / gain_scale : 1.0;
        for (int i = 1; i < p; ++i) unit *= gain_scale;
        return unit;
    }
    // Where the local fit may take K: away from p = 1 the unit is a guess of where the other poles lie, so three decades
    // are added on both sides.
    Range gain_limits(int p) const {
        const double unit = gain_unit(p), slack = p == 1 || gain_scale == 1.0 ? 1.0 : 1e3;
        return {gain.lo * unit / slack, gain.hi * unit * slack};
    }
};

}  // namespace gaident
