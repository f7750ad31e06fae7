#include "../gaident/estimation/filter.hpp"
#include "../gaident/estimation/zero_phase.hpp"
#include "../gaident/control/replay.hpp"
#include "bindings.hpp"

#include <algorithm>

using namespace gaident;

namespace {

std::string wrong_lengths(std::size_t n) {
    return "lengths: they must add up to the " + std::to_string(n) + " columns of the rows";
}

// Rows of `values`, each cut into records of these lengths, filtered by b/a.
RealArray filtered_rows(const RealArray& b, const RealArray& a, const RealArray& values,
                        const std::vector<std::size_t>& lengths) {
    if (values.ndim() != 2) throw std::invalid_argument("rows: a matrix is needed");
    const auto rows = static_cast<std::size_t>(values.shape(0)), n = static_cast<std::size_t>(values.shape(1));
    std::size_t at = 0;
    for (const std::size_t length : lengths) at = length <= n - at ? at + length : throw std::invalid_argument(wrong_lengths(n));
    if (at != n) throw std::invalid_argument(wrong_lengths(n));
    if (b.size() < 1 || a.size() < 1 || a.size() > max_recursion + 1 || a.data()[0] != 1.0)
        throw std::invalid_argument("b, a: at least one number each, a[0] = 1 and at most " + std::to_string(max_recursion) +
                                    " more");
    RealArray out({values.shape(0), values.shape(1)});
    double* const v = out.mutable_data();
    std::atomic<bool> stop{false};
    run_interruptibly(stop, rows * n, [&] { filtered(view(b), view(a), values.data(), v, rows, n, lengths, &stop); });
    return out;
}

// Rows b, a of filters, e and weight (n): sum of (weight v)^2 under each of them.
RealArray powers_of(const RealArray& b, const RealArray& a, const RealArray& e, const RealArray& weight,
                    const std::vector<std::size_t>& lengths) {
    const py::ssize_t most = max_recursion + 1;
    if (b.ndim() != 2 || a.ndim() != 2 || b.shape(0) != a.shape(0) || b.shape(1) != a.shape(1) || b.shape(1) < 1 ||
        b.shape(1) > most)
        throw std::invalid_argument("b, a: rows of as many numbers, at least one and at most " + std::to_string(most));
    for (py::ssize_t i = 0; i < a.shape(0); ++i)
        if (*a.data(i, 0) != 1.0) throw std::invalid_argument("a: each row begins with 1");
    std::size_t whole = 0;
    const auto n = static_cast<std::size_t>(e.size());
    for (const std::size_t length : lengths)
        whole = length <= n - whole ? whole + length : throw std::invalid_argument(wrong_lengths(n));
    if (whole != n) throw std::invalid_argument(wrong_lengths(n));
    if (weight.size() != e.size()) throw std::invalid_argument("weight: one number for each sample of e");
    RealArray out(b.shape(0));
    double* const sums = out.mutable_data();
    const auto filters = static_cast<std::size_t>(b.shape(0)), size = static_cast<std::size_t>(b.shape(1));
    std::atomic<bool> stop{false};
    run_interruptibly(stop, filters * n,
                      [&] { filtered_powers(b.data(), a.data(), filters, size, e.data(), weight.data(), lengths, sums, &stop); });
    return out;
}

// Rows of `values` forward and backward through sections (k, 6), each continued by `extension` samples at both ends.
RealArray smoothed_rows(const RealArray& sections, const RealArray& values, std::size_t extension) {
    if (sections.ndim() != 2 || sections.shape(1) != 6) throw std::invalid_argument("sections: rows of six numbers are needed");
    std::vector<Section> all(static_cast<std::size_t>(sections.shape(0)));
    for (std::size_t i = 0; i < all.size(); ++i) {
        std::copy_n(sections.data() + 6 * i, 6, all[i].begin());
        if (all[i][3] != 1.0) throw std::invalid_argument("sections: a_0 of each must be 1");
    }
    if (values.ndim() != 2 || values.shape(0) < 1 || values.shape(1) < 1)
        throw std::invalid_argument("rows: a matrix with at least one number is needed");
    const auto rows = static_cast<std::size_t>(values.shape(0)), n = static_cast<std::size_t>(values.shape(1));
    if (extension >= n) throw std::invalid_argument("extension: fewer samples than the " + std::to_string(n) + " of a row");
    RealArray out({values.shape(0), values.shape(1)});
    double* const v = out.mutable_data();
    std::atomic<bool> stop{false};
    run_interruptibly(stop, rows * n, [&] { zero_phase(all, values.data(), v, rows, n, extension, &stop); });
    return out;
}

// measured (n) - rows (r, n), which are written over.
RealArray errors_of(const RealArray& measured, py::array_t<double, py::array::c_style> rows, double lost) {
    if (rows.ndim() != 2 || measured.size() != rows.shape(1))
        throw std::invalid_argument("rows: a matrix with as many columns as were measured");
    double* const out = rows.mutable_data();
    {
        const ReleasedGil released;
        subtracted(measured.data(), out, static_cast<std::size_t>(rows.shape(0)), static_cast<std::size_t>(rows.shape(1)), lost);
    }
    return rows;
}

// A (m, m), drive (n, m), start (m): all x(0..n-1), with `newest` x(1..n), (n, m).
ComplexArray states(const ComplexArray& A, const ComplexArray& drive, const ComplexArray& start, bool newest) {
    const py::ssize_t m = start.size();
    if (A.ndim() != 2 || A.shape(0) != m || A.shape(1) != m || drive.ndim() != 2 || drive.shape(1) != m || start.ndim() != 1)
        throw std::invalid_argument("A, drive, start: (m, m), (n, m) and (m,) are needed");
    ComplexArray out({drive.shape(0), m});
    std::complex<double>* const x = out.mutable_data();
    std::copy_n(drive.data(), drive.size(), x);
    const std::size_t states = static_cast<std::size_t>(m), n = static_cast<std::size_t>(drive.shape(0));
    std::atomic<bool> stop{false};
    run_interruptibly(stop, n * states, [&] { state_recursion(A.data(), {start.data(), states}, x, n, newest, &stop); });
    return out;
}

RealArray products(const RealArray& e, int lags) {
    if (lags < 0) throw std::invalid_argument("lags: 0 or more");
    RealArray out(lags + 1);
    const std::size_t n = static_cast<std::size_t>(e.size()), count = static_cast<std::size_t>(lags) + 1;
    const std::span<double> sums{out.mutable_data(), count};
    std::atomic<bool> stop{false};
    run_interruptibly(stop, n * count, [&] { lagged_products(e.data(), n, sums, &stop); });
    return out;
}

// A copy on which `run` has worked.
RealArray changed(const RealArray& values, auto&& run) {
    RealArray out(values.size());
    const std::span<double> all{out.mutable_data(), static_cast<std::size_t>(out.size())};
    std::copy_n(values.data(), all.size(), all.begin());
    run(all);
    return out;
}

template <void (*run)(std::span<double>, double, double)>
RealArray replayed(const RealArray& values, double limit, double start) {
    return changed(values, [&](std::span<double> all) { run(all, limit, start); });
}

RealArray held(const RealArray& error, const Controller& controller, double newest, double before, const std::string& rule,
               double integral) {
    constexpr const char* names[] = {"held", "held_back", "tracked"};
    const auto found = std::find(std::begin(names), std::end(names), rule);
    if (found == std::end(names)) throw std::invalid_argument("rule: held, held_back or tracked, not " + rule);
    const auto hold = static_cast<Hold>(found - std::begin(names));
    return changed(error, [&](std::span<double> all) { held_torque(all, controller, newest, before, hold, integral); });
}

}  // namespace

void bind_filter(py::module_& m) {
    m.def("filtered", &filtered_rows, py::arg("b"), py::arg("a"), py::arg("rows"), py::arg("lengths"));
    m.def("filtered_powers", &powers_of, py::arg("b"), py::arg("a"), py::arg("e"), py::arg("weight"), py::arg("lengths"));
    m.def("zero_phase", &smoothed_rows, py::arg("sections"), py::arg("rows"), py::arg("extension"));
    m.def("errors_of", &errors_of, py::arg("measured"), py::arg("rows"), py::arg("lost"));
    m.def("state_recursion", &states, py::arg("A"), py::arg("drive"), py::arg("start"), py::arg("newest"));
    m.def("lagged_products", &products, py::arg("e"), py::arg("lags"));
    m.def("held_torque", &held, py::arg("error"), py::arg("controller"), py::arg("newest"), py::arg("before"), py::arg("rule"),
          py::arg("integral"));
    m.def("clamped_sum", &replayed<clamped_sum>, py::arg("steps"), py::arg("limit"), py::arg("start"));
    m.def("rate_limited", &replayed<rate_limited>, py::arg("command"), py::arg("step"), py::arg("start"));
}
