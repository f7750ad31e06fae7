// Shared by the binding files: array types and the way long work is run so that Ctrl-C and progress reach Python.
#pragma once

#include "../gaident/control/servo_equation.hpp"
#include "../gaident/identification/plant_search.hpp"

#include <pybind11/complex.h>
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <functional>
#include <memory>

namespace py = pybind11;

using RealArray = py::array_t<double, py::array::c_style | py::array::forcecast>;
using ComplexArray = py::array_t<std::complex<double>, py::array::c_style | py::array::forcecast>;

inline std::span<const double> view(const RealArray& a) { return {a.data(), static_cast<std::size_t>(a.size())}; }

gaident::Factors<double> make_factors(double gain, const ComplexArray& poles, const ComplexArray& zeros);
ComplexArray poles_of(const gaident::Factors<double>& f);
ComplexArray zeros_of(const gaident::Factors<double>& f);
RealArray to_array(const std::vector<double>& v);

// A record with the arrays it borrows.
struct PyRecord {
    RealArray input, output, straight;
    gaident::Record record;
    gaident::Clock clock;
    gaident::Feedforward feedforward;
    gaident::Between between;
    std::shared_ptr<const gaident::ServoEquation> equation;  // of a servo loop

    PyRecord(const gaident::Clock& controller, RealArray in, RealArray out, const std::string& start, double velocity0,
             const std::string& between_lines, RealArray straight_part, const gaident::Feedforward& fed);
    void close(const gaident::Loop& loop);
};

// The GIL, released until the end of the block.
// As py::gil_scoped_release, but where the interpreter ends meanwhile (a daemon thread), this thread stops here for ever, and the process
// ends without it: CPython would unwind the thread's stack, and the C++ frames on it would end the process by abort.
class ReleasedGil {
public:
    ReleasedGil() : state_(PyEval_SaveThread()) {}
    ~ReleasedGil();
    ReleasedGil(const ReleasedGil&) = delete;
    ReleasedGil& operator=(const ReleasedGil&) = delete;

private:
    PyThreadState* state_;
};

// A Python function's answer, asked from C++ frames: of an interpreter that ends meanwhile, as ReleasedGil.
py::object asked(const py::function& function, const py::tuple& arguments);

// Runs `work` on a thread of its own with the GIL released; every 50 ms looks for Ctrl-C (sets `stop`, waits for the work to end,
// raises KeyboardInterrupt) and calls `tick`.
// A Python exception raised by `tick` stops the work likewise.
void run_interruptibly(std::atomic<bool>& stop, const std::function<void()>& work, const std::function<void()>& tick);

// The same without `tick` for work that runs over so many samples; where these are few it is over before a thread for it would
// have started, and before anyone could press Ctrl-C.
void run_interruptibly(std::atomic<bool>& stop, std::size_t samples, const std::function<void()>& work);

void bind_control(py::module_& m);
void bind_simulate(py::module_& m);
void bind_filter(py::module_& m);
void bind_identify(py::module_& m);
void bind_effects(py::module_& m);
void bind_recurrence(py::module_& m);
