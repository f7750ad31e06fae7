#include "../gaident/nonlinear/effect_batch.hpp"
#include "bindings.hpp"

using namespace gaident;

namespace {

const char* name_of(Place place) {
    switch (place) {
        case Place::shaft: return "shaft";
        case Place::mechanism: return "mechanism";
        case Place::coupling: return "coupling";
        case Place::actuator: return "actuator";
        case Place::controller: return "controller";
        case Place::sensor: return "sensor";
        case Place::plant: return "plant";
        case Place::record: return "record";
    }
    return "";
}

py::list table() {
    py::list rows;
    for (const EffectInfo& info : effect_table) {
        if (info.at_load || info.several_waves) continue;  // as at the motor, and as one wave
        py::list parameters;
        for (const EffectParameter& p : info.parameters)
            parameters.append(py::make_tuple(p.name, p.unit, p.neutral, p.lowest, p.highest, p.above_lowest));
        rows.append(py::make_tuple(info.name, name_of(info.place), info.meaning, py::tuple(parameters), info.simulated,
                                   info.needs_two_masses, info.relation, info.remark, info.turns, waves_of(info)));
    }
    return rows;
}

Effect simulated_effect(const std::string& name) {
    for (int i = 0; i < effect_count; ++i)
        if (name == effect_table[static_cast<std::size_t>(i)].name && effect_table[static_cast<std::size_t>(i)].simulated)
            return static_cast<Effect>(i);
    throw std::invalid_argument("effects: '" + name + "' is no effect that can be simulated");
}

// The relation that these parameters break, or nothing.
std::string broken_relation(const std::string& name, const std::vector<double>& values) {
    const EffectInfo& info = info_of(simulated_effect(name));
    if (static_cast<int>(values.size()) != info.count()) throw std::invalid_argument("values: wrong number of parameters");
    return info.allowed == nullptr || info.allowed(values.data()) ? "" : info.relation;
}

void check_structure(Structure s, EffectSet effects) {
    if (effects.bits == 0) return;
    if (s.p < 1) throw std::invalid_argument("poles: a model with effects needs more poles than zeros");
    const auto stands_at = [&](Place place) { return effects.any([=](const EffectInfo& info) { return info.place == place; }); };
    if (s == Structure{1, 2} && stands_at(Place::plant) && stands_at(Place::mechanism))
        throw std::invalid_argument("effects: what changes the mechanism linearly does not go together with a changing inertia");
    if (!effects.needs_two_masses()) return;
    for (const EffectInfo& info : effect_table)
        if (info.needs_two_masses && effects.has(effect_named(info.name)) && !(s == Structure{1, 2}))
            throw std::invalid_argument(std::string("effects: ") + info.name + " needs two masses, p = 1 and q = 2");
    if (stands_at(Place::plant))
        throw std::invalid_argument(
            "effects: what changes the mechanism linearly does not go together with a nonlinear coupling");
}

EffectModel make_model(double gain, const ComplexArray& poles, const ComplexArray& zeros,
                       const std::vector<std::pair<std::string, std::vector<double>>>& effects) {
    EffectModel m;
    m.linear = make_factors(gain, poles, zeros);
    for (const auto& [name, values] : effects) {
        const Effect e = simulated_effect(name);
        if (static_cast<int>(values.size()) != info_of(e).count())
            throw std::invalid_argument("effects: '" + name + "' has another number of parameters");
        m.add(e, values.data());
    }
    check_structure(m.linear.structure, m.effects);
    return m;
}

// Natural parameters as gaident.models.factors has them: gain, real poles, (e1, e0) of pole pairs, the same for zeros.
Factors<double> factors_of(const double* x, int real_poles, int pole_pairs, int real_zeros, int zero_pairs) {
    Factors<double> f;
    const int poles = real_poles + 2 * pole_pairs, zeros = real_zeros + 2 * zero_pairs;
    f.structure = {poles - zeros, zeros};
    f.gain = *x++;
    const auto gather = [&x](int reals, int pairs, Pair<double>* pair, double& single) {
        const double* const real = x;
        x += reals;
        int n = 0;
        for (int i = 0; i < pairs; ++i, x += 2) pair[n++] = {x[0], x[1]};
        for (int i = 0; i + 1 < reals; i += 2) pair[n++] = real_pair(real[i], real[i + 1]);
        if (reals % 2 != 0) single = real[reals - 1];
    };
    gather(real_poles, pole_pairs, f.pole_pair, f.pole);
    gather(real_zeros, zero_pairs, f.zero_pair, f.zero);
    return f;
}

struct PyEffectRecord {
    RealArray input, position, velocity, velocity_feedforward, torque_feedforward;
    EffectJob job;

    PyEffectRecord(const Clock& clock, RealArray in, RealArray measured_position, const RealArray& measured_velocity,
                   double start_angle, const Loop& loop, RealArray fed_velocity, RealArray fed_torque, double torque_before)
        : input(std::move(in)),
          position(std::move(measured_position)),
          velocity(measured_velocity),
          velocity_feedforward(std::move(fed_velocity)),
          torque_feedforward(std::move(fed_torque)) {
        for (const auto& [signal, name] :
             {std::pair(&position, "position"), std::pair(&velocity_feedforward, "velocity_feedforward"),
              std::pair(&torque_feedforward, "torque_feedforward")})
            if (signal->size() != 0 && signal->size() != input.size())
                throw std::invalid_argument(std::string(name) + ": as many samples as the input are needed");
        if (clock.log_every < 1 || input.size() % clock.log_every != 0)
            throw std::invalid_argument("input: log_every samples are needed for each line of the log");
        job.record.input = view(input);
        job.record.position = view(position);
        job.record.velocity_feedforward = view(velocity_feedforward);
        job.record.torque_feedforward = view(torque_feedforward);
        job.record.log_every = clock.log_every;
        job.record.sample_time = clock.period;
        job.record.start_angle = start_angle;
        job.record.torque_before = torque_before;
        for (const double w : view(velocity)) job.record.top_speed = std::max(job.record.top_speed, std::abs(w));
        job.loop = loop;
        if (job.loop.kind == LoopKind::open || (job.loop.kind == LoopKind::servo && job.loop.servo.position_gain > 0.0)) return;
        for (const double r : job.record.input) job.record.top_speed = std::max(job.record.top_speed, std::abs(r));
    }
};

// One of a user's own effects: how it is asked, and its parameters, (models, parameters).
struct OwnEffect {
    OwnPlace place;
    py::function function;
    RealArray values;
};

OwnPlace own_place_named(const std::string& name) {
    if (name == "command") return OwnPlace::command;
    if (name == "torque") return OwnPlace::torque;
    if (name == "friction") return OwnPlace::friction;
    if (name == "torque@load") return OwnPlace::torque_at_load;
    if (name == "friction@load") return OwnPlace::friction_at_load;
    if (name == "actuator") return OwnPlace::actuator;
    if (name == "sensor") return OwnPlace::sensor;
    throw std::invalid_argument("own: '" + name + "' is no place for an effect of one's own");
}

// Python functions as own effects: function(velocity, angle, torque, command, time, *parameters), arrays of one number per lane, read only
// but for the answer.
// To be used with the GIL held.
class PyOwnEffects : public OwnEffects {
public:
    PyOwnEffects(const std::vector<std::tuple<std::string, py::function, RealArray>>& effects, std::size_t models) {
        for (const auto& [place, function, values] : effects) {
            if (values.ndim() != 2 || static_cast<std::size_t>(values.shape(0)) != models)
                throw std::invalid_argument("own: one row of parameters per model is needed");
            effects_.push_back({own_place_named(place), function, values});
        }
    }

    bool at(OwnPlace place) const override {
        return std::any_of(effects_.begin(), effects_.end(), [&](const OwnEffect& e) { return e.place == place; });
    }

    void begin(std::span<const std::size_t> models, const OwnSignals& signals, double* answer) override {
        width_ = models.size();
        signals_ = signals;
        answer_ = answer;
        parameters_.clear();
        for (const OwnEffect& e : effects_) {
            std::vector<RealArray> lanes;
            for (py::ssize_t k = 0; k < e.values.shape(1); ++k) {
                RealArray column(static_cast<py::ssize_t>(width_));
                for (std::size_t lane = 0; lane < width_; ++lane)
                    column.mutable_data()[lane] = e.values.at(static_cast<py::ssize_t>(models[lane]), k);
                lanes.push_back(read_only(std::move(column)));
            }
            parameters_.push_back(std::move(lanes));
        }
    }

    void ask(OwnPlace place, double time) override {
        double* const signal = replaced_at(place);
        const bool chained = signal != nullptr;
        const bool brakes = place == OwnPlace::friction || place == OwnPlace::friction_at_load;
        if (!chained) std::fill(answer_, answer_ + width_, 0.0);
        for (std::size_t i = 0; i < effects_.size(); ++i) {
            if (effects_[i].place != place) continue;
            const py::object answer = asked(effects_[i].function, arguments(parameters_[i], time));
            if (answer.is_none()) refuse(effects_[i].function, answer, time);
            const RealArray found = RealArray::ensure(answer);
            if (!found || (found.size() != 1 && static_cast<std::size_t>(found.size()) != width_)) {
                PyErr_Clear();
                throw std::invalid_argument("own: an effect's function has to give one number per lane");
            }
            for (std::size_t lane = 0; lane < width_; ++lane) {
                const double value = found.data()[found.size() == 1 ? 0 : lane];
                if (brakes && value < 0.0) refuse(effects_[i].function, py::float_(value), time);
                if (chained) signal[lane] = value;
                else answer_[lane] += value;
            }
        }
        if (chained) std::copy(signal, signal + width_, answer_);
    }

private:
    // The signal that an effect there answers in place of; null where the answers are added up.
    double* replaced_at(OwnPlace place) const {
        switch (place) {
            case OwnPlace::command: return signals_.command;
            case OwnPlace::actuator: return signals_.torque;
            case OwnPlace::sensor: return signals_.velocity;
            case OwnPlace::torque:
            case OwnPlace::friction:
            case OwnPlace::torque_at_load:
            case OwnPlace::friction_at_load: return nullptr;
        }
        return nullptr;
    }
    // What no function may answer; `refuse` of the object whose method is asked raises, in words of its own.
    [[noreturn]] static void refuse(const py::function& function, const py::object& answer, double time) {
        const py::object owner = py::getattr(function, "__self__", py::none());
        if (py::hasattr(owner, "refuse")) owner.attr("refuse")(answer, time);
        throw std::invalid_argument("own: an effect's function gave " + std::string(py::repr(answer)));
    }

    // Signals and parameters as a function is given them: copies, which it may keep for as long as it likes.
    py::tuple arguments(const std::vector<RealArray>& parameters, double time) const {
        py::tuple all(parameters.size() + 5);
        py::size_t k = 0;
        for (const double* const lanes : {signals_.velocity, signals_.angle, signals_.torque, signals_.command})
            all[k++] = read_only(RealArray(static_cast<py::ssize_t>(width_), lanes));
        all[k++] = time;
        for (const RealArray& lanes : parameters) all[k++] = lanes;
        return all;
    }
    static RealArray read_only(RealArray lanes) {
        py::detail::array_proxy(lanes.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
        return lanes;
    }

    std::vector<OwnEffect> effects_;
    std::vector<std::vector<RealArray>> parameters_;
    OwnSignals signals_{};
    double* answer_ = nullptr;
    std::size_t width_ = 0;
};

using OwnList = std::vector<std::tuple<std::string, py::function, RealArray>>;

py::tuple simulate_models(const PyEffectRecord& record, const std::vector<EffectModel>& models, const RealArray& initial_states,
                          int substeps, int workers, bool all, const std::string& kernel, bool lanes, const OwnList& own,
                          bool load) {
    EffectJob job = record.job;
    if (substeps < 0 || substeps > max_substeps) throw std::invalid_argument("substeps: 0 (as needed) to 64");
    job.substeps = substeps;
    job.workers = workers;
    job.lanes = lanes;
    if (!kernel.empty()) {
        job.kernel = effects_named(kernel.c_str());
        if (job.kernel == nullptr) throw std::invalid_argument("kernel: '" + kernel + "' is not available on this machine");
    }
    const std::size_t count = models.size(), samples = static_cast<std::size_t>(record.input.size() / job.record.log_every);
    std::vector<const double*> starts;
    if (initial_states.size() != 0) {
        if (initial_states.ndim() != 2 || static_cast<std::size_t>(initial_states.shape(0)) != count)
            throw std::invalid_argument("initial_states: one row per model is needed");
        for (std::size_t i = 0; i < count; ++i) {
            const int states = start_states(reduced(models[i], true).linear.structure, job.loop);
            if (initial_states.shape(1) != states)
                throw std::invalid_argument("initial_states: " + std::to_string(initial_states.shape(1)) + " numbers given, " +
                                            std::to_string(states) + " needed");
            starts.push_back(initial_states.data() + static_cast<py::ssize_t>(i) * initial_states.shape(1));
        }
    }
    if (job.loop.kind != LoopKind::continuous)
        for (const EffectModel& m : models)
            if (m.linear.structure.p < 1)
                throw std::invalid_argument("poles: a model without more poles than zeros exists only in the continuous loop");
    if (load)
        for (const EffectModel& m : models)
            if (!(m.linear.structure == Structure{1, 2}) ||
                m.effects.any([](const EffectInfo& info) { return info.place == Place::plant; }))
                throw std::invalid_argument("load: only two masses, p = 1 and q = 2, have a load");
    const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(count), static_cast<py::ssize_t>(samples)}, none{0, 0};
    RealArray velocity(shape), torque(all ? shape : none), angle(all ? shape : none);
    RealArray load_velocity(load ? shape : none), load_lag(load ? shape : none);
    const auto wanted = [](bool asked, RealArray& signal) { return asked ? signal.mutable_data() : nullptr; };
    const EffectOutputs out{velocity.mutable_data(), wanted(all, torque), wanted(all, angle), wanted(load, load_velocity),
                            wanted(load, load_lag)};
    if (own.empty()) {
        std::atomic<bool> stop{false};
        job.stop = &stop;
        run_interruptibly(stop, count * samples, [&] { simulate_effects(job, models, starts, out); });
    } else {  // Ctrl-C comes through the functions
        PyOwnEffects effects(own, count);
        job.own = &effects;
        simulate_effects(job, models, starts, out);
    }
    return py::make_tuple(velocity, torque, angle, load_velocity, load_lag);
}

// `shown`: "velocity", or of the load its "angle", the angle less the motor's ("lag") or the "load velocity".
py::array simulate_values(const PyEffectRecord& record, const RealArray& values, const std::tuple<int, int, int, int>& structure,
                          const std::vector<std::string>& effects, const RealArray& initial_states, int substeps, int workers,
                          const OwnList& own, const std::string& shown) {
    const auto [real_poles, pole_pairs, real_zeros, zero_pairs] = structure;
    const int poles = real_poles + 2 * pole_pairs, zeros = real_zeros + 2 * zero_pairs;
    if (std::min({real_poles, pole_pairs, real_zeros, zero_pairs}) < 0 || poles > max_plant_order ||
        zeros > max_plant_order / 2 || zeros > poles)
        throw std::invalid_argument("structure: at most 14 poles and 7 zeros, and no more zeros than poles");
    const int factors = 1 + real_poles + 2 * pole_pairs + real_zeros + 2 * zero_pairs;
    std::vector<Effect> chosen;
    int columns = factors;
    for (const std::string& name : effects) {
        chosen.push_back(simulated_effect(name));
        columns += info_of(chosen.back()).count();
    }
    if (values.ndim() != 2 || values.shape(1) != columns)
        throw std::invalid_argument("values: rows of " + std::to_string(columns) + " numbers are needed");
    std::vector<EffectModel> models(static_cast<std::size_t>(values.shape(0)));
    const double* x = values.data();
    for (EffectModel& m : models) {
        m.linear = factors_of(x, real_poles, pole_pairs, real_zeros, zero_pairs);
        x += factors;
        for (const Effect e : chosen) {
            m.add(e, x);
            x += info_of(e).count();
        }
        check_structure(m.linear.structure, m.effects);
    }
    const bool load = shown != "velocity", angle = shown == "angle";
    if (load && !angle && shown != "lag" && shown != "load velocity")
        throw std::invalid_argument("shown: 'velocity', or of the load 'angle', 'lag' or 'load velocity'");
    const py::tuple all = simulate_models(record, models, initial_states, substeps, workers, angle, "", true, own, load);
    if (angle) return py::array(all[2] + all[4]);
    return all[!load ? 0 : shown == "lag" ? 4 : 3];
}

}  // namespace

void bind_effects(py::module_& m) {
    m.def("effect_table", &table);
    m.def("broken_relation", &broken_relation, py::arg("name"), py::arg("values"));
    py::class_<EffectModel>(m, "EffectModel")
        .def(py::init(&make_model), py::arg("gain"), py::arg("poles"), py::arg("zeros"), py::arg("effects"));
    py::class_<PyEffectRecord>(m, "EffectRecord")
        .def(py::init<const Clock&, RealArray, RealArray, const RealArray&, double, const Loop&, RealArray, RealArray, double>(),
             py::kw_only(), py::arg("clock"), py::arg("input"), py::arg("position"), py::arg("velocity"), py::arg("start_angle"),
             py::arg("loop"), py::arg("velocity_feedforward") = RealArray(), py::arg("torque_feedforward") = RealArray(),
             py::arg("torque_before") = 0.0)
        .def("simulate", &simulate_models, py::arg("models"), py::arg("initial_states"), py::arg("substeps"), py::arg("workers"),
             py::arg("all"), py::arg("kernel") = "", py::arg("lanes") = true, py::arg("own") = OwnList(), py::arg("load") = false)
        .def("simulate_values", &simulate_values, py::arg("values"), py::arg("structure"), py::arg("effects"),
             py::arg("initial_states"), py::arg("substeps"), py::arg("workers"), py::arg("own") = OwnList(),
             py::arg("shown") = "velocity");
}
