#include "effect_batch.hpp"

#include "../runtime/parallel.hpp"
#include "../simulation/simulate.hpp"

#include <numeric>
#include <tuple>

namespace gaident {

namespace {

// A reduced model and how it is to be run; models of one kind share lanes.
struct Planned {
    EffectModel model;
    const double* start = nullptr;
    int substeps = 0;  // 0: linear

    auto kind() const {
        return std::tuple(substeps, model.effects.bits, model.linear.structure.p, model.linear.structure.q, start != nullptr);
    }
};

class Job {
public:
    Job(const EffectJob& job, std::span<const EffectModel> models, std::span<const double* const> starts,
        const EffectOutputs& out)
        : job_(job),
          out_(out),
          samples_(job.record.input.size() / static_cast<std::size_t>(job.record.log_every)),
          planned_(models.size()),
          order_(models.size()) {
        for (std::size_t i = 0; i < models.size(); ++i) {
            Planned& p = planned_[i];
            p.start = starts.empty() ? nullptr : starts[i];
            p.model = reduced(models[i], p.start != nullptr);
            if (job.loop.kind == LoopKind::servo && job.loop.servo.delay > 0.0) delay_torque(p.model, job.loop.servo.delay);
            if (p.model.effects.bits != 0 || job.own != nullptr || job.loop.kind == LoopKind::servo || load())
                p.substeps = job.substeps > 0 ? job.substeps : substeps_for(p.model, job.record, job.loop, job.own != nullptr);
            if (in_pairs(p.model.effects, job.own)) p.substeps += p.substeps % 2;
        }
        std::iota(order_.begin(), order_.end(), std::size_t{0});
        std::stable_sort(order_.begin(), order_.end(),
                         [&](std::size_t a, std::size_t b) { return planned_[a].kind() < planned_[b].kind(); });
        for (std::size_t first = 0; first < order_.size();) {
            std::size_t end = first + 1;
            while (end < order_.size() && end - first < effect_lanes && job.lanes &&
                   planned_[order_[end]].kind() == planned_[order_[first]].kind())
                ++end;
            groups_.emplace_back(first, end);
            first = end;
        }
    }

    void run() {
        parallel(groups_.size(), job_.own != nullptr ? 1 : job_.workers, [&](std::size_t i) {
            const FlushDenormals flush;
            stop_if_asked(job_.stop);
            const std::span<const std::size_t> group(&order_[groups_[i].first], groups_[i].second - groups_[i].first);
            const Planned& first = planned_[group[0]];
            if (first.substeps == 0 || job_.loop.kind == LoopKind::continuous) linear(group);
            if (first.substeps == 0) return;
            if (job_.loop.kind != LoopKind::continuous) return effects(group, first.model.effects, job_.own, Write::set);
            effects(group, first.model.effects, job_.own, Write::add);
            effects(group, EffectSet{}, nullptr, Write::subtract);
        });
    }

private:
    enum class Write { set, add, subtract };

    // Whether the mean velocity over a sample of the controller is asked for, and whether of pairs of substeps.
    bool averaged() const { return job_.loop.kind == LoopKind::servo && job_.loop.servo.differenced; }
    bool in_pairs(EffectSet effects, const OwnEffects* own) const {
        return averaged() && (effects.meets(effects_known_at_ends()) || (own != nullptr && own->at(OwnPlace::sensor)));
    }

    // Whether the load's motion is asked for.
    bool load() const { return out_.load_velocity != nullptr; }

    double* row(double* base, std::size_t model) const { return base == nullptr ? nullptr : base + model * samples_; }

    void linear_alone(std::size_t i) {
        const Planned& p = planned_[i];
        std::vector<double> unwanted(out_.torque == nullptr ? samples_ : 0);
        double* const torque = out_.torque == nullptr ? unwanted.data() : row(out_.torque, i);
        simulate<double>(p.model.linear, job_.record.input, job_.record.sample_time, job_.loop, p.start,
                         {row(out_.velocity, i), samples_}, {torque, samples_}, job_.stop);
    }

    void linear(std::span<const std::size_t> group) {
        if (group.size() == 1 || out_.torque != nullptr) {
            for (const std::size_t i : group) linear_alone(i);
        } else {
            linear_lanes(group);
        }
        if (out_.angle == nullptr) return;
        for (const std::size_t i : group) {
            const double* const w = row(out_.velocity, i);
            double angle = job_.record.start_angle;
            for (std::size_t k = 0; k < samples_; ++k) {
                if (k > 0) angle += 0.5 * job_.record.sample_time * (w[k] + w[k - 1]);
                row(out_.angle, i)[k] = angle;
            }
        }
    }

    // Coefficients one by one, as simulate() has them, so that each row is the same bit for bit.
    void linear_lanes(std::span<const std::size_t> group) {
        Record record;
        record.input = record.output = job_.record.input;
        record.sample_time = job_.record.sample_time;
        DoubleGroup lanes;
        for (std::size_t lane = 0; lane < DoubleGroup::width; ++lane) {
            const Planned& p = planned_[group[std::min(lane, group.size() - 1)]];
            const Prepared c = prepare(p.model.linear, record, job_.loop, p.start);
            lanes.order = c.response.order;
            for (int k = 0; k < lanes.order; ++k) {
                lanes.a[k][lane] = c.response.a[k];
                lanes.x[k][lane] = c.x[k];
            }
            for (int k = 0; k <= lanes.order; ++k) lanes.b[k][lane] = c.response.b[k];
            lanes.s[lane] = c.s;
        }
        const auto& kernels = kernels_named(job_.kernel->name)->in_double;
        std::vector<double> y(std::min(samples_, samples_between_stops) * DoubleGroup::width);
        const ControllerState<double> controller(job_.loop.controller, Clock{job_.record.sample_time});
        for (std::size_t k = 0; k < samples_; k += samples_between_stops) {
            stop_if_asked(job_.stop);
            const std::size_t n = std::min(samples_ - k, samples_between_stops);
            if (job_.loop.limited()) kernels.stepped_outputs(lanes, controller, record.input.data() + k, n, y.data());
            else kernels.outputs(lanes, record.input.data() + k, n, y.data());
            spread(group, y.data(), 0, out_.velocity, k, n, DoubleGroup::width, Write::set);
        }
    }

    // Lanes side by side, from the sample `at` on, into the rows of the group from the sample `first` on.
    void spread(std::span<const std::size_t> group, const double* from, std::size_t at, double* to, std::size_t first,
                std::size_t count, std::size_t width, Write write) const {
        if (to == nullptr) return;
        for (std::size_t lane = 0; lane < group.size(); ++lane) {
            double* const out = row(to, group[lane]) + first;
            for (std::size_t k = 0; k < count; ++k) {
                const double v = from[(at + k) * width + lane] + 0.0;  // at rest 0, not -0
                out[k] = write == Write::set ? v : write == Write::add ? out[k] + v : out[k] - v;
            }
        }
    }

    // Spreads what a run has written since it was last asked.
    class Spread final : public EffectSink {
    public:
        Spread(const Job& job, std::span<const std::size_t> group, std::size_t width) : job_(job), group_(group), width_(width) {}

        // A signal, in lanes side by side, and the rows that it is of; null where it is not asked for.
        double* signal(double* rows, Write write) {
            if (rows == nullptr) return nullptr;
            signals_.push_back({std::vector<double>(effect_block * width_), rows, write});
            return signals_.back().lanes.data();
        }
        bool take(std::size_t n) override {
            const std::size_t every = static_cast<std::size_t>(job_.job_.record.log_every);
            const std::size_t end = std::min((n + every - 1) / every, job_.samples_);
            while (taken_ < end) {
                const std::size_t at = taken_ % effect_block, count = std::min(end - taken_, effect_block - at);
                for (const Signal& s : signals_) job_.spread(group_, s.lanes.data(), at, s.rows, taken_, count, width_, s.write);
                taken_ += count;
            }
            return job_.job_.stop == nullptr || !job_.job_.stop->load(std::memory_order_relaxed);
        }

    private:
        struct Signal {
            std::vector<double> lanes;
            double* rows;
            Write write;
        };
        const Job& job_;
        std::span<const std::size_t> group_;
        std::size_t width_, taken_ = 0;
        std::vector<Signal> signals_;
    };

    void effects(std::span<const std::size_t> group, EffectSet set, OwnEffects* own, Write write) {
        const bool shows_load = load() && write != Write::subtract;
        const bool alone = group.size() == 1 && own == nullptr && !set.meets(effects_in_lanes_only());
        const std::size_t width = alone ? 1 : effect_lanes;
        const Planned& first = planned_[group[0]];
        std::vector<double> constants(effect_constants * width);
        std::vector<Effects::Tables> tables(width);
        EffectRun run;
        run.own_at_load = own != nullptr && (own->at(OwnPlace::torque_at_load) || own->at(OwnPlace::friction_at_load));
        int back = 0;
        for (std::size_t lane = 0; lane < width; ++lane) {
            const Planned& p = planned_[group[std::min(lane, group.size() - 1)]];
            EffectModel model = p.model;
            model.effects = set;
            PreparedEffects c;
            prepare_effects(model, job_.record, job_.loop, p.substeps, p.start, c, run.own_at_load || shows_load);
            double flat[effect_constants];
            std::memcpy(flat, &c.constants, sizeof flat);
            for (std::size_t k = 0; k < effect_constants; ++k) constants[k * width + lane] = flat[k];
            tables[lane] = c.tables;
            run.two_masses = c.two_masses;
            const int steps = job_.loop.kind == LoopKind::continuous ? 1 : p.substeps;
            Effects::each([&]<class E>() {
                if constexpr (HasTable<E>)
                    if (set.has<E>()) back = std::max(back, E::reach(c.tables.template of<E>(), steps));
            });
        }
        run.effects = set;
        run.loop = job_.loop;
        run.sample_time = job_.record.sample_time;
        run.log_every = job_.record.log_every;
        run.substeps = first.substeps;
        run.averaged = averaged();
        run.in_pairs = in_pairs(set, own);
        run.order = first.model.linear.structure.poles();
        run.moving = first.start != nullptr;
        run.input = job_.record.input;
        run.velocity_feedforward = job_.record.velocity_feedforward;
        run.torque_feedforward = job_.record.torque_feedforward;
        run.position = job_.record.position;
        run.start_angle = job_.record.start_angle;
        run.tables = tables.data();
        const bool looks_back = set.meets(effects_with(Hooks::tabulate));
        std::size_t ring = 2;
        while (ring < static_cast<std::size_t>(back) + 2) ring *= 2;
        std::vector<double> history(looks_back ? ring * width : 0);
        run.history = history.data();
        run.history_mask = ring - 1;

        Spread spread(*this, group, width);
        run.sink = &spread;
        run.velocity = spread.signal(out_.velocity, write);
        run.torque = spread.signal(out_.torque, write);
        run.angle = spread.signal(out_.angle, write);
        run.load_velocity = spread.signal(shows_load ? out_.load_velocity : nullptr, Write::set);
        run.load_lag = spread.signal(shows_load ? out_.load_lag : nullptr, Write::set);
        std::vector<double> asked(own == nullptr ? 0 : 5 * width, no_command);
        if (own != nullptr) {
            std::vector<std::size_t> models(width);
            for (std::size_t lane = 0; lane < width; ++lane) models[lane] = group[std::min(lane, group.size() - 1)];
            run.own = own;
            run.own_signals = {asked.data(), &asked[width], &asked[2 * width], &asked[3 * width]};
            run.own_answer = &asked[4 * width];
            own->begin(models, run.own_signals, &asked[4 * width]);
        }
        (alone ? job_.kernel->alone : job_.kernel->run)(run, constants.data());
        stop_if_asked(job_.stop);
        spread.take(run.input.size());
    }

    const EffectJob& job_;
    const EffectOutputs& out_;
    std::size_t samples_;
    std::vector<Planned> planned_;
    std::vector<std::size_t> order_;
    std::vector<std::pair<std::size_t, std::size_t>> groups_;
};

}  // namespace

void simulate_effects(const EffectJob& job, std::span<const EffectModel> models, std::span<const double* const> starts,
                      const EffectOutputs& out) {
    Job(job, models, starts, out).run();
}

}  // namespace gaident
