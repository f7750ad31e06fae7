#include "bindings.hpp"

PYBIND11_MODULE(_core, m) {
    m.doc() = "The core of gaident: recurrences, genetic search and local fit. Use the package's own functions instead.";
    bind_control(m);
    bind_simulate(m);
    bind_filter(m);
    bind_identify(m);
    bind_effects(m);
    bind_recurrence(m);
}
