// Controller, clock, loop and record as the objects that every other function takes; built by keyword, so that no number is told
// from another by its place.
#include "bindings.hpp"

using namespace gaident;

namespace {

constexpr double endless = std::numeric_limits<double>::infinity();

LoopKind loop_named(const std::string& name) {
    if (name == "continuous") return LoopKind::continuous;
    if (name == "sampled") return LoopKind::sampled;
    if (name == "open") return LoopKind::open;
    throw std::invalid_argument("kind must be 'continuous', 'sampled' or 'open', not '" + name + "'");
}

Start start_named(const std::string& name) {
    if (name == "rest") return Start::rest;
    if (name == "steady") return Start::steady;
    if (name == "free") return Start::free;
    throw std::invalid_argument("start must be 'rest', 'steady' or 'free', not '" + name + "'");
}

}  // namespace

PyRecord::PyRecord(const Clock& clock, RealArray in, RealArray out, const std::string& start, double velocity0)
    : input(std::move(in)),
      output(std::move(out)),
      record{view(input), view(output), clock.period, start_named(start), velocity0} {}

void bind_control(py::module_& m) {
    py::class_<Clock>(m, "Clock").def(py::init([](double period) { return Clock{period}; }), py::kw_only(), py::arg("period"));
    py::class_<Controller>(m, "Controller")
        .def(py::init([](double kp, double ki, double torque_limit, double integrator_limit) {
                 return Controller{.kp = kp, .ki = ki, .torque_limit = torque_limit, .integrator_limit = integrator_limit};
             }),
             py::kw_only(), py::arg("kp"), py::arg("ki"), py::arg("torque_limit") = endless,
             py::arg("integrator_limit") = endless);
    py::class_<Loop>(m, "Loop").def(
        py::init([](const std::string& kind, const Controller& controller) { return Loop{loop_named(kind), controller}; }),
        py::kw_only(), py::arg("kind"), py::arg("controller") = Controller{});
    py::class_<PyRecord>(m, "Record")
        .def(py::init<const Clock&, RealArray, RealArray, const std::string&, double>(), py::kw_only(), py::arg("clock"),
             py::arg("input"), py::arg("output"), py::arg("start"), py::arg("velocity0"));
}
