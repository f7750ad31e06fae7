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

py::dict effect_numbers(const EffectConstants<double>& c, EffectSet effects) {
    using enum Effect;
    py::dict d;
    const auto with = [&](Effect e, py::list values) {
        if (effects.has(e)) d[effect_table[static_cast<std::size_t>(e)].name] = values;
    };
    // Those that add up to one law of friction are given as that, under "law".
    if (effects.has_any(coulomb_friction, asymmetric_friction, quadratic_drag))
        d["law"] =
            numbers_of(c.law.level_positive, c.law.level_negative, c.law.viscous_positive, c.law.viscous_negative, c.law.drag);
    with(stribeck_friction, numbers_of(c.stribeck_torque, c.stribeck_static, c.stribeck_slowness));
    with(presliding_friction, numbers_of(c.bristle_torque, c.bristle_stiffness, c.bristle_per_break));
    with(friction_drift, numbers_of(c.drift_torque, c.drift_rate));
    with(load_torque, numbers_of(c.load));
    with(unbalance, numbers_of(c.unbalance_amplitude, c.unbalance_phase));
    with(cogging, numbers_of(c.cogging_amplitude, c.cogging_order, c.cogging_phase));
    with(torque_saturation, numbers_of(c.saturation));
    with(torque_dead_band, numbers_of(c.dead_band));
    with(torque_lag, numbers_of(c.lag_decay, c.lag_mean));
    with(integrator_clamp, numbers_of(c.integrator_limit));
    with(command_rate_limit, numbers_of(c.rate_step));
    with(velocity_filter, numbers_of(c.filter_decay, c.filter_old, c.filter_new));
    with(velocity_ripple, numbers_of(c.ripple_amplitude, c.ripple_order, c.ripple_phase));
    with(velocity_quantisation, numbers_of(c.quantum));
    return d;
}

// {"a", "b"} of the linear plant at the sample time where no effect is left (substeps 0), else of the plant at the substep, or of two
// masses, and the effects' numbers as the loop with effects uses them. substeps 0: as many as the model needs.
py::dict recurrence(const EffectModel& model, double dt, const std::string& loop_kind, double kp, double ki, double torque_limit,
                    double integrator_limit, int substeps, double top_speed) {
    if (substeps < 0 || substeps > max_substeps) throw std::invalid_argument("substeps: 0 (as needed) to 64");
    const Loop loop = make_loop(loop_kind, kp, ki, torque_limit, integrator_limit);
    const EffectModel left = reduced(model, false);
    py::dict d;
    if (left.effects.bits == 0) {
        const Delta<double> plant = plant_of(left.linear, loop, dt);
        d["substeps"] = 0;
        d["a"] = numbers(plant.a, plant.order);
        d["b"] = numbers(plant.b, plant.order + 1);
        return d;
    }
    EffectRecord record;
    record.sample_time = dt;
    record.top_speed = top_speed;
    const int m = substeps > 0 ? substeps : substeps_for(left, record, loop);
    PreparedEffects made;
    prepare_effects(left, record, loop, m, nullptr, made);
    const EffectConstants<double>& c = made.constants;
    const int n = left.linear.structure.poles();
    if (!std::isfinite(c.x[0])) throw std::invalid_argument("model: it makes no two masses, and cannot carry its effects");
    d["substeps"] = m;
    d["effects"] = effect_numbers(c, left.effects);
    if (made.two_masses) {
        d["phi"] = numbers(&c.phi[0][0], 9);
        d["motor"] = numbers(c.motor, 3);
        d["coupling"] = numbers(c.coupling, 3);
        d["shaft"] = numbers_of(c.KG, c.DG, c.per_scale, c.half_gap, c.cubic);
    } else {
        d["a"] = numbers(c.a, n);
        d["b"] = numbers(c.b, n + 1);
    }
    if (left.effects.has(Effect::transport_delay)) {
        py::list back, share;
        for (int j = 0; j < m; ++j) {
            back.append(made.delay.back[j]);
            share.append(made.delay.share[j]);
        }
        d["delay"] = py::make_tuple(back, share);
    }
    return d;
}

}  // namespace

void bind_recurrence(py::module_& m) {
    m.def("recurrence", &recurrence, py::arg("model"), py::arg("dt"), py::arg("loop"), py::arg("kp"), py::arg("ki"),
          py::arg("torque_limit"), py::arg("integrator_limit"), py::arg("substeps"), py::arg("top_speed"));
}
