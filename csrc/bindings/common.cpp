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
            const py::gil_scoped_release release;
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
        const py::gil_scoped_release release;
        work();
    } else {
        run_interruptibly(stop, work, [] {});
    }
}
