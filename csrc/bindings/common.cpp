#include "../gaident/plant/roots.hpp"
#include "bindings.hpp"

#include <condition_variable>
#include <mutex>
#include <thread>

using namespace gaident;

Factors<double> make_factors(double gain, const ComplexArray& poles, const ComplexArray& zeros) {
    return factors_from_roots(gain, {poles.data(), static_cast<std::size_t>(poles.size())},
                              {zeros.data(), static_cast<std::size_t>(zeros.size())});
}

ComplexArray poles_of(const Factors<double>& f) {
    std::complex<double> poles[max_plant_order], zeros[max_plant_order];
    roots_of(f, poles, zeros);
    return ComplexArray(f.structure.poles(), poles);
}

ComplexArray zeros_of(const Factors<double>& f) {
    std::complex<double> poles[max_plant_order], zeros[max_plant_order];
    roots_of(f, poles, zeros);
    return ComplexArray(f.structure.q, zeros);
}

RealArray to_array(const std::vector<double>& v) { return RealArray(static_cast<py::ssize_t>(v.size()), v.data()); }

namespace {

// CPython ends a thread that asks for the GIL of an interpreter that is gone, by unwinding its stack (from 3.14 on it stops it, as here).
[[noreturn]] void stand_still() {
    for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

}  // namespace

ReleasedGil::~ReleasedGil() {
    try {
        PyEval_RestoreThread(state_);
    } catch (...) {  // of C functions: no exception but that unwinding
        stand_still();
    }
}

py::object asked(const py::function& function, const py::tuple& arguments) {
    PyObject* answer = nullptr;
    try {
        answer = PyObject_CallObject(function.ptr(), arguments.ptr());
    } catch (...) {
        stand_still();
    }
    if (answer == nullptr) throw py::error_already_set();
    return py::reinterpret_steal<py::object>(answer);
}

void run_interruptibly(std::atomic<bool>& stop, const std::function<void()>& work, const std::function<void()>& tick) {
    std::exception_ptr error;
    std::mutex lock;
    std::condition_variable ended;
    bool done = false;
    std::thread worker([&] {
        try {
            work();
        } catch (...) {
            error = std::current_exception();
        }
        const std::lock_guard<std::mutex> guard(lock);
        done = true;
        ended.notify_one();
    });
    std::exception_ptr interruption;
    for (bool running = true; running;) {
        {
            const ReleasedGil released;
            std::unique_lock<std::mutex> guard(lock);
            running = !ended.wait_for(guard, std::chrono::milliseconds(50), [&] { return done; });
        }
        if (!running || interruption) continue;
        try {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            tick();
        } catch (...) {
            interruption = std::current_exception();
            stop = true;
        }
    }
    worker.join();
    if (interruption) std::rethrow_exception(interruption);
    if (error) std::rethrow_exception(error);
}

void run_interruptibly(std::atomic<bool>& stop, std::size_t samples, const std::function<void()>& work) {
    if (samples < 100000) {
        const ReleasedGil released;
        work();
    } else {
        run_interruptibly(stop, work, [] {});
    }
}
