// Several waves of the angle as one effect: the sum of what E makes of each.
//
//     cogging           -sum_k A_k sin(n_k theta + phase_k)
//     velocity_ripple   w (1 + sum_k a_k n_k cos(n_k theta + phase_k))
//
// It is an effect of its own in the list, in calls of its own, so that a loop with one wave contains nothing of the others.
// In the registry its name is that of the effect with "_waves" behind it, and its parameters are those of one wave after the other's.
// A wave of amplitude 0 is none.
#pragma once

#include "registry.hpp"

#include <algorithm>

namespace gaident {

inline constexpr std::size_t most_waves = 4;

template <class E>
struct SeveralWaves {
    using OfOne = E;
    static constexpr std::size_t each = std::size(E::parameters);

private:
    static constexpr std::string_view suffix = "_waves";
    static constexpr std::size_t length = std::string_view(E::info.name).size();
    static constexpr std::array<char, length + suffix.size() + 1> name = [] {
        std::array<char, length + suffix.size() + 1> both{};
        for (std::size_t i = 0; i < length; ++i) both[i] = E::info.name[i];
        for (std::size_t i = 0; i < suffix.size(); ++i) both[length + i] = suffix[i];
        return both;
    }();
    static constexpr std::array<EffectParameter, most_waves * each> parameters = [] {
        std::array<EffectParameter, most_waves * each> all{};
        for (std::size_t i = 0; i < all.size(); ++i) all[i] = E::parameters[i % each];
        return all;
    }();

public:
    static constexpr EffectInfo info = [] {
        EffectInfo several = E::info;
        several.name = name.data();
        several.parameters = parameters;
        several.several_waves = true;
        return several;
    }();
    static constexpr Hooks hooks = [] {
        Hooks found = E::hooks & Hooks::substeps;
        if (hook::torque<E>) found = found | Hooks::torque_apart;
        if (hook::sensor<E>) found = found | Hooks::sensor_apart;
        return found;
    }();

    template <class R>
    struct Coefficients {
        typename E::template Coefficients<R> wave[most_waves];
    };
    static constexpr Pace pace = E::pace;
    static void prepare(const double* p, const PreparedFor& made, Coefficients<double>& c) {
        for (std::size_t k = 0; k < most_waves; ++k) E::prepare(p + k * each, made, c.wave[k]);
    }
    static double substeps(const double* p, const Circumstances& at)
        requires(hook::substeps<E>)
    {
        double most = 0.0;
        for (std::size_t k = 0; k < most_waves; ++k)
            if (p[k * each] != 0.0) most = std::max(most, E::substeps(p + k * each, at));
        return most;
    }

    template <class R>
        requires(hook::torque<E>)
    static R torque_apart(const Coefficients<R>& c, R theta) {
        R sum = E::torque(c.wave[0], theta);
        for (std::size_t k = 1; k < most_waves; ++k) sum = sum + E::torque(c.wave[k], theta);
        return sum;
    }
    template <class R>
        requires(hook::sensor<E>)
    static R sensor_apart(const Coefficients<R>& c, R theta, R w) {
        R sum = R(1.0);
        for (std::size_t k = 0; k < most_waves; ++k) sum = E::with_wave(c.wave[k], theta, sum);
        return w * sum;
    }
};

}  // namespace gaident
