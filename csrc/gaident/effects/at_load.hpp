// A shaft effect at the load of two masses: the same coefficients, state and functions, asked with the load's velocity and angle.
// It is an effect of its own in the list, so that a model may have one of a kind at either end, or at both; in the registry its
// name is that of the effect with "@load" behind it.
#pragma once

#include "registry.hpp"

namespace gaident {

template <class E>
struct AtLoad {
    using AtMotor = E;
    static_assert(E::info.place == Place::shaft, "only a shaft effect has a side");

private:
    static constexpr std::string_view suffix = "@load";
    static constexpr std::size_t length = std::string_view(E::info.name).size();
    static constexpr std::array<char, length + suffix.size() + 1> name = [] {
        std::array<char, length + suffix.size() + 1> both{};
        for (std::size_t i = 0; i < length; ++i) both[i] = E::info.name[i];
        for (std::size_t i = 0; i < suffix.size(); ++i) both[length + i] = suffix[i];
        return both;
    }();

public:
    static constexpr EffectInfo info = [] {
        EffectInfo there = E::info;
        there.name = name.data();
        there.needs_two_masses = true;
        there.at_load = true;
        return there;
    }();
    static constexpr Hooks hooks = Hooks::load | (E::hooks & Hooks::substeps);

    template <class R>
    using Coefficients = typename E::template Coefficients<R>;
    template <class R>
    using State = typename detail::StateAt<AtLoad, E, R>::Type;
    static constexpr Pace pace = E::pace;
    static void prepare(const double* p, const PreparedFor& time, Coefficients<double>& c) { E::prepare(p, time, c); }
    static double substeps(const double* p, const Circumstances& at)
        requires(hook::substeps<E>)
    {
        Circumstances there = at;
        there.inverse_inertia = at.inverse_load;
        return E::substeps(p, there);
    }
};

namespace detail {

template <class Listed, class... E>
struct ShaftAtLoad {
    using Type = Listed;
};
template <class... Listed, class E, class... Rest>
struct ShaftAtLoad<EffectList<Listed...>, E, Rest...> : ShaftAtLoad<EffectList<Listed...>, Rest...> {};
template <class... Listed, class E, class... Rest>
    requires(E::info.place == Place::shaft)
struct ShaftAtLoad<EffectList<Listed...>, E, Rest...> : ShaftAtLoad<EffectList<Listed..., AtLoad<E>>, Rest...> {};

template <class List>
struct LoadSideOf;
template <class... E>
struct LoadSideOf<EffectList<E...>> : ShaftAtLoad<EffectList<>, E...> {};

template <class First, class Second>
struct Joined;
template <class... E, class... F>
struct Joined<EffectList<E...>, EffectList<F...>> {
    using Type = EffectList<E..., F...>;
};

}  // namespace detail

// The shaft effects of a list at the load, in its order.
template <class List>
using LoadSideOf = typename detail::LoadSideOf<List>::Type;
template <class First, class Second>
using Joined = typename detail::Joined<First, Second>::Type;

}  // namespace gaident
