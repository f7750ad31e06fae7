// Controller, clock, loop and record as the objects that every other function takes; built by keyword, so that no number is told
// from another by its place.
#include "bindings.hpp"

#include "gaident/control/servo.hpp"

using namespace gaident;

namespace {

constexpr double endless = std::numeric_limits<double>::infinity();

LoopKind loop_named(const std::string& name) {
    if (name == "continuous") return LoopKind::continuous;
    if (name == "sampled") return LoopKind::sampled;
    if (name == "servo") return LoopKind::servo;
    if (name == "open") return LoopKind::open;
    throw std::invalid_argument("kind must be 'continuous', 'sampled', 'servo' or 'open', not '" + name + "'");
}

Between between_named(const std::string& name) {
    if (name == "held") return Between::held;
    if (name == "straight") return Between::straight;
    if (name == "mixed") return Between::mixed;
    throw std::invalid_argument("between must be 'held', 'straight' or 'mixed', not '" + name + "'");
}

AntiWindup anti_windup_named(const std::string& name) {
    if (name == "none") return AntiWindup::none;
    if (name == "hold") return AntiWindup::hold;
    if (name == "tracking") return AntiWindup::tracking;
    throw std::invalid_argument("anti_windup must be 'none', 'hold' or 'tracking', not '" + name + "'");
}

FilterChain chain_of(const std::vector<DigitalFilter>& filters, const char* name) {
    if (filters.size() > FilterChain::most)
        throw std::invalid_argument(std::string(name) + ": at most " + std::to_string(FilterChain::most) + " filters");
    FilterChain chain;
    for (const DigitalFilter& f : filters) chain.filter[chain.count++] = f;
    return chain;
}

Start start_named(const std::string& name) {
    if (name == "rest") return Start::rest;
    if (name == "steady") return Start::steady;
    if (name == "free") return Start::free;
    throw std::invalid_argument("start must be 'rest', 'steady' or 'free', not '" + name + "'");
}

// The torque [N m] that a servo makes of measured signals, one after the other at its own clock, from rest.
// stored [N m]: what its integrator and its torque filters hold before the first sample, for a load; 0 for none.
RealArray servo_torque(const Clock& clock, const Loop& loop, const RealArray& source, const RealArray& velocity,
                       const RealArray& position, const RealArray& velocity_feedforward, const RealArray& torque_feedforward,
                       double stored) {
    const py::ssize_t n = source.size();
    for (const RealArray* signal : {&velocity, &position, &velocity_feedforward, &torque_feedforward})
        if (signal->size() != n) throw std::invalid_argument("every signal needs as many samples as the source");
    Servo<double> servo(loop.controller, loop.servo, clock.period);
    if (stored != 0.0) servo.rest(0.0, 0.0, 0.0, stored);
    RealArray torque(n);
    for (py::ssize_t i = 0; i < n; ++i) {
        const double r = servo.command(static_cast<std::size_t>(i), source.at(i), velocity_feedforward.at(i), position.at(i));
        torque.mutable_data()[i] = servo.torque(r, velocity.at(i), torque_feedforward.at(i));
    }
    return torque;
}

}  // namespace

PyRecord::PyRecord(const Clock& controller, RealArray in, RealArray out, const std::string& start, double velocity0,
                   const std::string& between_lines, RealArray straight_part, const Feedforward& fed)
    : input(std::move(in)),
      output(std::move(out)),
      straight(std::move(straight_part)),
      clock(controller),
      feedforward(fed),
      between(between_named(between_lines)) {
    record.input = view(input);
    record.output = view(output);
    record.sample_time = clock.period * clock.log_every;
    record.start = start_named(start);
    record.velocity0 = velocity0;
    if ((between == Between::mixed) != (straight.size() > 0))
        throw std::invalid_argument("straight: it belongs to a mixed command, and only to it");
    record.straight = view(straight);
}

void PyRecord::close(const Loop& loop) {
    if (loop.kind != LoopKind::servo) {
        if (clock.log_every != 1 || between != Between::held)
            throw std::invalid_argument("records: only a servo is faster than its log");
        return;
    }
    equation = std::make_shared<const ServoEquation>(loop, clock, feedforward, between);
    record.servo = equation.get();
}

void bind_control(py::module_& m) {
    py::class_<Clock>(m, "Clock")
        .def(py::init([](double period, int log_every) { return Clock{period, log_every}; }), py::kw_only(), py::arg("period"),
             py::arg("log_every") = 1);
    py::class_<DigitalFilter>(m, "DigitalFilter")
        .def_property_readonly("b", [](const DigitalFilter& f) { return std::vector{f.b0, f.b1, f.b2}; })
        .def_property_readonly("a", [](const DigitalFilter& f) { return std::vector{1.0, f.a1, f.a2}; });
    m.def("low_pass", &low_pass, py::arg("time_constant"), py::arg("period"));
    m.def("notch", &notch, py::kw_only(), py::arg("frequency"), py::arg("numerator_damping"), py::arg("denominator_damping"),
          py::arg("period"));
    py::class_<ServoSettings>(m, "ServoSettings")
        .def(py::init([](double newest, double command_weight, const std::string& anti_windup, double tracking_time,
                         const std::vector<DigitalFilter>& command_filters, const std::vector<DigitalFilter>& velocity_filters,
                         const std::vector<DigitalFilter>& torque_filters, double position_gain, int position_every,
                         double delay) {
                 if (!(delay >= 0.0)) throw std::invalid_argument("delay must be 0 or more");
                 if (position_every < 1) throw std::invalid_argument("position_every must be 1 or more");
                 return ServoSettings{newest,
                                      command_weight,
                                      anti_windup_named(anti_windup),
                                      tracking_time,
                                      chain_of(command_filters, "command_filters"),
                                      chain_of(velocity_filters, "velocity_filters"),
                                      chain_of(torque_filters, "torque_filters"),
                                      position_gain,
                                      position_every,
                                      delay,
                                      false};
             }),
             py::kw_only(), py::arg("newest"), py::arg("command_weight"), py::arg("anti_windup"), py::arg("tracking_time"),
             py::arg("command_filters"), py::arg("velocity_filters"), py::arg("torque_filters"), py::arg("position_gain"),
             py::arg("position_every"), py::arg("delay") = 0.0);
    py::class_<Controller>(m, "Controller")
        .def(py::init([](double kp, double ki, double torque_limit, double integrator_limit) {
                 return Controller{.kp = kp, .ki = ki, .torque_limit = torque_limit, .integrator_limit = integrator_limit};
             }),
             py::kw_only(), py::arg("kp"), py::arg("ki"), py::arg("torque_limit") = endless,
             py::arg("integrator_limit") = endless);
    py::class_<Loop>(m, "Loop")
        .def(py::init([](const std::string& kind, const Controller& controller, const ServoSettings& servo) {
                 return Loop{loop_named(kind), controller, servo};
             }),
             py::kw_only(), py::arg("kind"), py::arg("controller") = Controller{}, py::arg("servo") = ServoSettings{})
        .def("differenced", [](Loop loop) {
            if (loop.kind != LoopKind::servo) throw std::invalid_argument("kind: only a servo reads a differenced angle");
            loop.servo.differenced = true;
            return loop;
        });
    m.def("servo_torque", &servo_torque, py::kw_only(), py::arg("clock"), py::arg("loop"), py::arg("source"), py::arg("velocity"),
          py::arg("position"), py::arg("velocity_feedforward"), py::arg("torque_feedforward"), py::arg("stored"));
    m.attr("MOST_STATES") = max_loop_order;
    m.def(
        "servo_order",
        [](const Loop& loop, const Clock& clock) { return ServoEquation(loop, clock, {}, Between::held).order(0); },
        py::kw_only(), py::arg("loop"), py::arg("clock"));
    py::class_<PyRecord>(m, "Record")
        .def(py::init([](const Clock& clock, RealArray input, RealArray output, const std::string& start, double velocity0,
                         const std::string& between, std::optional<RealArray> straight, double velocity_feedforward,
                         double acceleration_feedforward) {
                 const Feedforward fed{velocity_feedforward, acceleration_feedforward};
                 return PyRecord(clock, std::move(input), std::move(output), start, velocity0, between,
                                 straight ? std::move(*straight) : RealArray(0), fed);
             }),
             py::kw_only(), py::arg("clock"), py::arg("input"), py::arg("output"), py::arg("start"), py::arg("velocity0"),
             py::arg("between") = "held", py::arg("straight") = py::none(), py::arg("velocity_feedforward") = 0.0,
             py::arg("acceleration_feedforward") = 0.0);
}
