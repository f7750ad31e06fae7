// Each hook of an effect is looked for with its arguments: an effect that has all of them lacks exactly the one that is hidden.
#include "gaident/effects/list.hpp"

using namespace gaident;

namespace {

struct All {
    static constexpr EffectParameter parameters[] = {{"torque", "N m", 0.0, 0.0}};
    static constexpr EffectInfo info{.name = "all", .place = Place::shaft, .meaning = "every hook", .parameters = parameters};
    static constexpr Hooks hooks = Hooks::command | Hooks::controller | Hooks::actuator | Hooks::actuator_dynamics |
                                   Hooks::torque | Hooks::law | Hooks::level | Hooks::loaded | Hooks::friction |
                                   Hooks::after_friction | Hooks::coupling | Hooks::sensor | Hooks::sensor_dynamics |
                                   Hooks::reading | Hooks::plant | Hooks::begin | Hooks::substeps | Hooks::possible |
                                   Hooks::tabulate | Hooks::level_of_angle | Hooks::hysteresis | Hooks::torque_of_time | Hooks::inertia;
    static constexpr Pace pace = Pace::sample;

    template <class R>
    struct Coefficients {
        R torque;
    };
    template <class R>
    struct State {
        R output;
    };
    struct Table {
        int back;
    };

    static void prepare(const double*, const PreparedFor&, Coefficients<double>&);
    static double substeps(const double*, const Circumstances&);
    static bool possible(const double*);
    static void tabulate(const double*, const PreparedFor&, Table&);
    static int reach(const Table&, int);
    static Factors<double> plant(const double*, Factors<double>);
    static double loaded_twist(const Coefficients<double>&, double, double, double);
    template <class R>
    static void begin(const Coefficients<R>&, State<R>&, const Beginning<R>&);
    template <class R>
    static R command(const Coefficients<R>&, State<R>&, R);
    template <class R>
    static void controller(const Coefficients<R>&, ControllerState<R>&);
    template <class R>
    static R actuator(const Coefficients<R>&, R);
    template <class R, class Past>
    static Course<R> actuator_dynamics(const Coefficients<R>&, State<R>&, const Past&, Course<R>);
    template <class R>
    static R torque(const Coefficients<R>&, R);
    template <class R>
    static void law(const Coefficients<R>&, FrictionLaw<R>&);
    template <class R>
    static R level(const Coefficients<R>&, R);
    template <class R>
    static R level_of_angle(const Coefficients<R>&, R);
    template <class R>
    static R torque_of_time(const Coefficients<R>&, R);
    template <class R>
    static void inertia(const Coefficients<R>&, R, FrictionStep<R>&);
    template <class R>
    static R loaded(const Coefficients<R>&, R);
    template <class R>
    static void friction(const Coefficients<R>&, State<R>&, FrictionStep<R>&);
    template <class R>
    static void after_friction(const Coefficients<R>&, State<R>&, const FrictionStep<R>&, R);
    template <class R>
    static R coupling(const Coefficients<R>&, R, R, R&, R);
    template <class R>
    static R mean_coupling(const Coefficients<R>&, R, R, R&, R&, R);
    template <class R>
    static R wound(const Coefficients<R>&, State<R>&, R);
    template <class R>
    static R mean_wound(const Coefficients<R>&, const State<R>&, R);
    template <class R>
    static R sensor(const Coefficients<R>&, R, R);
    template <class R>
    static R sensor_dynamics(const Coefficients<R>&, State<R>&, R, R);
    template <class R>
    static R reading(const Coefficients<R>&, R);
};
static_assert(hook::Checked<All>::right);

template <class E>
constexpr bool lacks(Hooks one) {
    return (hook::all_of<E>() | one) == All::hooks && (hook::all_of<E>() & one) == Hooks::none;
}

// Without arguments, or no function at all.
struct Command : All {
    static double command();
};
static_assert(lacks<Command>(Hooks::command));
struct Controls : All {
    static void controller();
};
static_assert(lacks<Controls>(Hooks::controller));
struct Actuator : All {
    static double actuator();
};
static_assert(lacks<Actuator>(Hooks::actuator));
struct ActuatorDynamics : All {
    static double actuator_dynamics();
};
static_assert(lacks<ActuatorDynamics>(Hooks::actuator_dynamics));
struct Torque : All {
    static double torque();
};
static_assert(lacks<Torque>(Hooks::torque));
struct Law : All {
    static void law();
};
static_assert(lacks<Law>(Hooks::law));
struct Level : All {
    static double level();
};
static_assert(lacks<Level>(Hooks::level));
struct LevelOfAngle : All {
    static double level_of_angle();
};
static_assert(lacks<LevelOfAngle>(Hooks::level_of_angle));
struct TorqueOfTime : All {
    static double torque_of_time();
};
static_assert(lacks<TorqueOfTime>(Hooks::torque_of_time));
struct Inertia : All {
    static void inertia();
};
static_assert(lacks<Inertia>(Hooks::inertia));
struct Loaded : All {
    static double loaded();
};
static_assert(lacks<Loaded>(Hooks::loaded));
struct Friction : All {
    static void friction();
};
static_assert(lacks<Friction>(Hooks::friction));
struct AfterFriction : All {
    static void after_friction();
};
static_assert(lacks<AfterFriction>(Hooks::after_friction));
struct Coupling : All {
    static double coupling();
};
static_assert(lacks<Coupling>(Hooks::coupling));
struct MeanCoupling : All {
    static double mean_coupling();
};
static_assert(lacks<MeanCoupling>(Hooks::coupling));
struct LoadedTwist : All {
    static double loaded_twist();
};
static_assert(lacks<LoadedTwist>(Hooks::coupling | Hooks::hysteresis));
struct Wound : All {
    static double wound();
};
static_assert(lacks<Wound>(Hooks::hysteresis));
struct MeanWound : All {
    static double mean_wound();
};
static_assert(lacks<MeanWound>(Hooks::hysteresis));
struct Sensor : All {
    static double sensor();
};
static_assert(lacks<Sensor>(Hooks::sensor));
struct SensorDynamics : All {
    static double sensor_dynamics();
};
static_assert(lacks<SensorDynamics>(Hooks::sensor_dynamics));
struct Reading : All {
    static double reading();
};
static_assert(lacks<Reading>(Hooks::reading));
struct Plant : All {
    static Factors<double> plant();
};
static_assert(lacks<Plant>(Hooks::plant));
struct Begin : All {
    static void begin();
};
static_assert(lacks<Begin>(Hooks::begin));
struct Substeps : All {
    static double substeps();
};
static_assert(lacks<Substeps>(Hooks::substeps));
struct Possible : All {
    static bool possible();
};
static_assert(lacks<Possible>(Hooks::possible));
struct Tabulate : All {
    static void tabulate();
};
static_assert(lacks<Tabulate>(Hooks::tabulate));
struct Reach : All {
    static int reach();
};
static_assert(lacks<Reach>(Hooks::tabulate));

// Those that every effect has.
struct OtherPace : All {
    static constexpr int pace = 2;
};
static_assert(hook::pace<All> && !hook::pace<OtherPace>);
struct Prepare : All {
    static void prepare();
};
static_assert(hook::prepare<All> && !hook::prepare<Prepare>);

}  // namespace

int main() { return 0; }
