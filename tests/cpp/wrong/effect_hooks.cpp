// Effects as somebody might write them wrongly.
// It compiles with none of the macros below, and with each of them not (CMakeLists.txt).
#include "gaident/effects/list.hpp"

using namespace gaident;

namespace {

struct Brake {
    static constexpr EffectParameter parameters[] = {{"torque", "N m", 0.0, 0.0}};
    static constexpr EffectInfo info{
        .name = "brake", .place = Place::shaft, .meaning = "a torque that brakes", .parameters = parameters};
#if defined(HOOKS_NOT_SAID)
#elif defined(NOTHING_AT_ITS_PLACE) || defined(NOT_LISTED)
    static constexpr Hooks hooks = Hooks::none;
#elif defined(AT_ANOTHER_PLACE)
    static constexpr Hooks hooks = Hooks::sensor;
#else
    static constexpr Hooks hooks = Hooks::torque | Hooks::substeps;
#endif

    template <class R>
    struct Coefficients {
        R torque;
    };
#if defined(MISSPELT_PACE)
    static constexpr Pace pase = Pace::fine;
#elif defined(OTHER_PACE)
    static constexpr int pace = 2;
#else
    static constexpr Pace pace = Pace::fine;
#endif
#if defined(MISSPELT_PREPARE)
    static void prepair(const double* p, const PreparedFor&, Coefficients<double>& c) { c.torque = p[0]; }
#else
    static void prepare(const double* p, const PreparedFor&, Coefficients<double>& c) { c.torque = p[0]; }
#endif

#if defined(MISSPELT_OPTION)
    static double substep(const double*, const Circumstances&) { return 2.0; }
#elif !defined(NOTHING_AT_ITS_PLACE) && !defined(AT_ANOTHER_PLACE)
    static double substeps(const double*, const Circumstances&) { return 2.0; }
#endif

    template <class R>
#if defined(MISSPELT_HOOK)
    static R torqe(const Coefficients<R>& c, R) {
        return c.torque;
    }
#elif defined(OTHER_ARGUMENTS)
    static R torque(const Coefficients<R>& c) {
        return c.torque;
    }
#elif defined(AT_ANOTHER_PLACE)
    static R sensor(const Coefficients<R>& c, R, R w) {
        return w + c.torque;
    }
#elif defined(NOTHING_AT_ITS_PLACE)
    static R other(const Coefficients<R>& c) {
        return c.torque;
    }
#else
    static R torque(const Coefficients<R>& c, R) {
        return c.torque;
    }
#endif
};

}  // namespace

int main() { return EffectList<Brake>::size - 1; }
