// The centre of the core: simulate many candidates against the records, and hold them against measured frequency responses.
#pragma once

#include "../plant/held.hpp"
#include "candidates.hpp"
#include "error_sum.hpp"
#include "../control/loop.hpp"
#include "../runtime/stop.hpp"
#include "record.hpp"
#include "response.hpp"

#include <functional>
#include <vector>

namespace gaident {

class Workers;

struct Experiment {
    std::vector<Record> records;
    Loop loop;
    std::vector<const Response*> responses = {};  // borrowed
    const Kernels* kernels = &best_kernels();
    const std::atomic<bool>* stop = nullptr;
    Workers* workers = nullptr;  // threads that share the work on long records; null: none

    void check() const;  // throws std::invalid_argument, naming what is wrong
    std::size_t samples() const;  // of the records, and numbers of the responses
    // Long enough for one candidate's run over the records to be worth handing to another thread.
    bool is_long() const { return samples() >= 4096; }
    // Calls work(0) ... work(n-1), which run over the records each; the last is begun first.
    template <class Work>
    void share(std::size_t n, const Work& work) const {
        if (workers != nullptr && is_long()) return share_among_workers(n, work);
        while (n > 0) work(--n);
    }
    void share_among_workers(std::size_t n, const std::function<void(std::size_t)>& work) const;
    void stop_if_asked() const { gaident::stop_if_asked(stop); }
};

// Number of states a record's start is described by: the plant's p + q, and the controller's stored torque in a closed loop.
// (A record in a servo loop starts at rest.)
inline int start_states(Structure s, const Loop& loop) { return s.poles() + (loop.kind == LoopKind::open ? 0 : 1); }

// Samples between two looks at the stop flag, and the chunk a long record is run in.
inline constexpr std::size_t chunk_samples = 512;

// The plant as the loop discretises it: bilinear in the continuous loop, behind a zero-order hold otherwise.
Delta<double> plant_of(const Factors<double>& g, const Loop& loop, double sample_time);

// The start of a record in steady motion: constant velocity y0 needs the torque y0 / G(0), which in a closed loop the integrator
// stores. Writes start_states() numbers.
void steady_start(const Delta<double>& plant, const Record& record, const Loop& loop, double* start);

// Response (closed loop, or plant where the loop is stepped or open) and initial state of one candidate on one record.
struct Prepared {
    Delta<double> response;
    double x[max_loop_order]{};
    double s = 0.0;
};

// `start` contains start_states() numbers, or is null: then the record's own start (rest, or steady motion) is used.
Prepared prepare(const Factors<double>& g, const Record& record, const Loop& loop, const double* start);

// Responses and initial states of up to eight candidates on one record: as prepare(), bit for bit in the continuous loop.
// Behind a hold all must have the same structure, and the last digits differ, since the fastest lane decides how often the
// exponential is doubled. starts[i], where not null, is candidate i's `start`; an empty span means none has one.
// Lanes beyond the candidates repeat the last.
void load_group(const Experiment& experiment, const Record& record, std::span<const Factors<double>* const> candidates,
                std::span<const double* const> starts, DoubleGroup& group);

// Error sums of candidates of any mixture of structures.
// All memory is taken in the constructor.
// In float a candidate that 24 bits cannot represent (float_suffices) is run in double all the same, and so is every loop with
// limits, where a rounded torque goes through the plant, and every servo loop, whose filters leave poles far from z = 1.
class Batch {
public:
    Batch(const Experiment& experiment, std::size_t capacity, bool in_float);

    // sums[i] = sum over records and samples of (output - y_i)^2, and J of each response; worst_error_sum where a candidate diverges.
    void errors(std::span<const Factors<double>> candidates, std::span<double> sums);
    void errors(const Candidates& candidates, std::span<double> sums);

private:
    static constexpr int bank_groups = 8;  // so many groups at once

    // What a record looks like to the sample loops.
    template <class T>
    struct View {
        std::span<const T> input, output;  // output: of the settling loop, its deviation from the command
    };

    void run(std::size_t record, const Candidates& candidates, double* sums);
    std::size_t group_end(std::size_t first, std::size_t count) const;
    template <class T, class G>
    void advance(const View<T>& view, const Record& record, G* groups, int lanes, double* sums) const;
    template <class T, class G>
    void advance_part(const View<T>& view, const Record& record, G* groups, int lanes, std::size_t from, std::size_t to,
                      double* sums) const;

    const Experiment& experiment_;
    bool in_float_;
    std::vector<std::size_t> order_;  // candidates sorted by order, stable
    std::vector<Structure> sorted_;   // their structures
    std::vector<std::uint8_t> keys_;
    std::vector<const Factors<double>*> list_;
    std::vector<char> settling_;      // per record: a constant command in a PI loop without limits
    std::vector<double> deviations_;  // output minus command of the records that settle
    std::vector<float> floats_;       // inputs and outputs of the records in float
    std::vector<View<double>> views_;
    std::vector<View<float>> float_views_;
    DoubleGroup bank_[bank_groups];
    FloatGroup float_bank_[bank_groups / 2];
};

}  // namespace gaident
