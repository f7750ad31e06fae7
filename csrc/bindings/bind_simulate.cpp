#include "../gaident/target/mirror.hpp"
#include "../gaident/simulation/simulate.hpp"
#include "bindings.hpp"

using namespace gaident;

namespace {

// In a drive's arithmetic; the torque is the controller's answer to the velocity, in double.
void simulate_mirrored(const Factors<double>& g, std::span<const double> input, const Clock& clock, const Loop& loop,
                       const double* start, const std::string& arithmetic, std::span<double> velocity, std::span<double> torque,
                       const std::atomic<bool>& stop) {
    if (start != nullptr) throw std::invalid_argument("initial_state: in arithmetic '" + arithmetic + "' a model starts at rest");
    mirror_velocity(arithmetic, false, g, input, clock.period, loop, velocity, &stop);
    ControllerState<double> controller(loop.controller, clock);
    for (std::size_t k = 0; k < input.size(); ++k) torque[k] = controller.step(input[k] - velocity[k]);
}

// (velocity, whether it left the arithmetic's range)
py::tuple mirrored(const std::string& arithmetic, bool in_z, double gain, const ComplexArray& poles, const ComplexArray& zeros,
                   const Clock& clock, const RealArray& input, const Controller& controller) {
    const Factors<double> g = make_factors(gain, poles, zeros);
    const Loop loop{LoopKind::continuous, controller};
    RealArray velocity(input.size());
    const bool left = mirror_velocity(arithmetic, in_z, g, view(input), clock.period, loop,
                                      {velocity.mutable_data(), static_cast<std::size_t>(input.size())});
    return py::make_tuple(velocity, left);
}

py::tuple simulate_model(double gain, const ComplexArray& poles, const ComplexArray& zeros, const Clock& clock,
                         const RealArray& input, const Loop& loop, const RealArray& initial_state,
                         const std::string& arithmetic) {
    const Factors<double> g = make_factors(gain, poles, zeros);
    if (loop.kind != LoopKind::continuous && g.structure.p < 1)
        throw std::invalid_argument("poles: a model without more poles than zeros exists only in the continuous loop");
    const auto states = static_cast<py::ssize_t>(start_states(g.structure, loop));
    if (initial_state.size() != 0 && initial_state.size() != states)
        throw std::invalid_argument("initial_state: " + std::to_string(initial_state.size()) + " numbers given, " +
                                    std::to_string(states) + " needed");
    RealArray velocity(input.size()), torque(input.size());
    const std::span<double> w{velocity.mutable_data(), static_cast<std::size_t>(input.size())};
    const std::span<double> u{torque.mutable_data(), static_cast<std::size_t>(input.size())};
    const std::span<const double> in = view(input);
    const double* const start = initial_state.size() == 0 ? nullptr : initial_state.data();
    std::atomic<bool> stop{false};
    run_interruptibly(stop, in.size(), [&] {
        if (arithmetic == "double") simulate<double>(g, in, clock.period, loop, start, w, u, &stop);
        else if (arithmetic == "float") simulate_in_float(g, in, clock.period, loop, start, w, u, &stop);
        else simulate_mirrored(g, in, clock, loop, start, arithmetic, w, u, stop);
    });
    return py::make_tuple(velocity, torque);
}

py::tuple discrete_model(double gain, const ComplexArray& poles, const ComplexArray& zeros, const Clock& clock,
                         const Loop& loop) {
    const Factors<double> g = make_factors(gain, poles, zeros);
    if (loop.kind != LoopKind::continuous && g.structure.p < 1)
        throw std::invalid_argument("poles: a model without more poles than zeros exists only in the continuous loop");
    const Delta<double> plant = plant_of(g, loop, clock.period);
    const Delta<double> h = loop.kind == LoopKind::open ? plant : close_loop(plant, loop.controller, clock);
    RealArray alpha(h.order + 1), beta(h.order);
    powers_of_z(h, alpha.mutable_data(), beta.mutable_data());
    return py::make_tuple(alpha, beta);
}

}  // namespace

void bind_simulate(py::module_& m) {
    m.def("simulate", &simulate_model, py::arg("gain"), py::arg("poles"), py::arg("zeros"), py::arg("clock"), py::arg("input"),
          py::arg("loop"), py::arg("initial_state"), py::arg("arithmetic") = "double");
    m.def("mirrored", &mirrored, py::arg("arithmetic"), py::arg("in_z"), py::arg("gain"), py::arg("poles"), py::arg("zeros"),
          py::arg("clock"), py::arg("input"), py::arg("controller"));
    m.def("discrete", &discrete_model, py::arg("gain"), py::arg("poles"), py::arg("zeros"), py::arg("clock"), py::arg("loop"));
}
