// A model as the numbers of its recurrence, for writing it in another language.
#include "../gaident/simulation/batch.hpp"
#include "../gaident/nonlinear/effect_prepare.hpp"
#include "bindings.hpp"

using namespace gaident;

namespace {

py::list numbers(const double* x, int n) {
    py::list all;
    for (int i = 0; i < n; ++i) all.append(x[i]);
    return all;
}

template <class... Value>
py::list numbers_of(Value... value) {
    py::list all;
    (all.append(value), ...);
    return all;
}

// Name -> coefficients of each effect there, in the order of its header.
py::dict effect_numbers(const PreparedEffects& made, EffectSet effects) {
    py::dict d;
    AllEffects::each([&]<class E>() {
        if (!effects.has<E>()) return;
        const auto& c = made.constants.of<E>();
        double flat[sizeof c / sizeof(double) + 1] = {};
        std::memcpy(flat, &c, HasCoefficients<E> ? sizeof c : 0);
        d[E::info.name] = numbers(flat, HasCoefficients<E> ? static_cast<int>(sizeof c / sizeof(double)) : 0);
    });
    return d;
}

// Name -> (torques back, share) of each effect with a table, for every substep.
py::dict effect_tables(const PreparedEffects& made, EffectSet effects, int substeps) {
    py::dict d;
    Effects::each([&]<class E>() {
        if constexpr (HasTable<E>) {
            if (!effects.has<E>()) return;
            const TableOf<E>& table = made.tables.of<E>();
            py::list back, share;
            for (int j = 0; j < substeps; ++j) {
                back.append(table.back[j]);
                share.append(table.share[j]);
            }
            d[E::info.name] = py::make_tuple(back, share);
        }
    });
    return d;
}

// {"a", "b"} of the linear plant at the sample time where no effect is left (substeps 0), else of the plant at the substep, or of
// two masses, and the effects' numbers as the loop with effects uses them. substeps 0: as many as the model needs.
py::dict recurrence(const EffectModel& model, const Clock& clock, const Loop& loop, int substeps, double top_speed) {
    if (substeps < 0 || substeps > max_substeps) throw std::invalid_argument("substeps: 0 (as needed) to 64");
    const EffectModel left = reduced(model, false);
    py::dict d;
    if (left.effects.bits == 0) {
        const Delta<double> plant = plant_of(left.linear, loop, clock.period);
        d["substeps"] = 0;
        d["a"] = numbers(plant.a, plant.order);
        d["b"] = numbers(plant.b, plant.order + 1);
        return d;
    }
    EffectRecord record;
    record.sample_time = clock.period;
    record.top_speed = top_speed;
    const int m = substeps > 0 ? substeps : substeps_for(left, record, loop);
    PreparedEffects made;
    prepare_effects(left, record, loop, m, nullptr, made);
    const EffectConstants<double>& c = made.constants;
    const int n = left.linear.structure.poles();
    if (!std::isfinite(c.x[0])) throw std::invalid_argument("model: it makes no two masses, and cannot carry its effects");
    d["substeps"] = m;
    d["effects"] = effect_numbers(made, left.effects);
    if (made.two_masses) {
        d["phi"] = numbers(&c.phi[0][0], 9);
        d["motor"] = numbers(c.motor, 3);
        d["coupling"] = numbers(c.coupling, 3);
        d["shaft"] = numbers_of(c.KG, c.DG, c.per_scale);
    } else {
        d["a"] = numbers(c.a, n);
        d["b"] = numbers(c.b, n + 1);
    }
    d["bend"] = numbers(c.bend, made.two_masses ? 3 : n);
    d["bend_of"] = numbers_of(c.bend_end[0], c.bend_end[1], c.bend_rise);
    d["rise"] = numbers(c.rise, made.two_masses ? 3 : n);
    d["tables"] = effect_tables(made, left.effects, m);
    return d;
}

}  // namespace

void bind_recurrence(py::module_& m) {
    m.def("recurrence", &recurrence, py::arg("model"), py::arg("clock"), py::arg("loop"), py::arg("substeps"),
          py::arg("top_speed"));
}
