// The filters that a drive has beside its velocity controller, at the controller's own clock.
//
//     y(n) = b0 u(n) + b1 u(n-1) + b2 u(n-2) - a1 y(n-1) - a2 y(n-2)
#pragma once

#include "../numeric/elementary.hpp"

#include <cmath>
#include <numbers>

namespace gaident {

struct DigitalFilter {
    double b0 = 1.0, b1 = 0.0, b2 = 0.0, a1 = 0.0, a2 = 0.0;
};

// 1/(tau s + 1), exact for an input that is held from one sample to the next: y(n) = y(n-1) + (1 - e^(-T/tau)) (u(n) - y(n-1)).
inline DigitalFilter low_pass(double time_constant, double period) {
    const double pole = time_constant > 0.0 ? std::exp(-period / time_constant) : 0.0;
    return {.b0 = 1.0 - pole, .a1 = -pole};
}

// (s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2), w = 2 pi frequency, by the bilinear transformation that keeps w where it is:
// s -> w/tan(w T/2) (z - 1)/(z + 1).
inline DigitalFilter notch(double frequency, double numerator_damping, double denominator_damping, double period) {
    const double t = std::tan(std::numbers::pi * frequency * period), scale = 1.0 / (1.0 + 2.0 * denominator_damping * t + t * t);
    const double middle = 2.0 * (t * t - 1.0) * scale;
    return {.b0 = (1.0 + 2.0 * numerator_damping * t + t * t) * scale,
            .b1 = middle,
            .b2 = (1.0 - 2.0 * numerator_damping * t + t * t) * scale,
            .a1 = middle,
            .a2 = (1.0 - 2.0 * denominator_damping * t + t * t) * scale};
}

// Filters one behind the other.
struct FilterChain {
    static constexpr int most = 8;
    DigitalFilter filter[most];
    int count = 0;
};

// Their memory, in observer form.
template <class R>
class FilterMemory {
public:
    R step(const FilterChain& chain, R u) {
        for (int i = 0; i < chain.count; ++i) {
            const DigitalFilter& f = chain.filter[i];
            const R y = fma(R(f.b0), u, x1_[i]);
            x1_[i] = fnma(R(f.a1), y, fma(R(f.b1), u, x2_[i]));
            x2_[i] = fnma(R(f.a2), y, R(f.b2) * u);
            u = y;
        }
        return u;
    }
    // As if u had come for ever; each leaves a constant as it is.
    void rest(const FilterChain& chain, R u) {
        for (int i = 0; i < chain.count; ++i) {
            const DigitalFilter& f = chain.filter[i];
            x2_[i] = R(f.b2 - f.a2) * u;
            x1_[i] = fma(R(f.b1 - f.a1), u, x2_[i]);
        }
    }

private:
    R x1_[FilterChain::most] = {}, x2_[FilterChain::most] = {};
};

}  // namespace gaident
