// One candidate against one record in any arithmetic: genes -> coefficients -> recurrence -> fitness.
// What runs in a drive (static_search.hpp) and on the host where a search mirrors it (mirror.hpp). Continuous loop, no limits.
//
// An arithmetic A names its types:
//
//     Number    parameters, coefficients and costs as they lie in memory
//     Signal    a velocity in a register          Sample    a velocity of the record in memory
//     State     a state of the recurrence in memory
//     Sum       the sum of squared errors in a register
//     Scaling   what is known before the run of how large things get; empty for floats
//
// and how one is made of another; see Plain.
#pragma once

#include "../control/closed_loop.hpp"
#include "../genetic/decode.hpp"
#include "../simulation/fitness.hpp"

#include <type_traits>

namespace gaident {

// How large the signals of a search can get: the record's peak [rad/s] and length, and the ranges of the genes.
struct Extent {
    double peak;
    std::size_t samples;
    const SearchRanges* ranges;
    Controller controller;
    Clock clock;
};

// double and float as they are, and numbers that know a memory word M from a register R and are otherwise like them.
template <class M, class R = M>
struct Plain {
    using Number = M;
    using Signal = R;
    using Sample = M;
    using State = M;
    using Sum = R;
    struct Scaling {
        constexpr Scaling() = default;
        explicit constexpr Scaling(const Extent&) {}
    };
    static constexpr double room = std::numeric_limits<double>::infinity();          // for signals, in peaks
    static constexpr int orders_in_registers = std::is_floating_point_v<M> ? 7 : 0;  // orders that get a loop of their own
    static constexpr Sample sample(double x, const Scaling&) { return static_cast<M>(x); }
    static constexpr Signal signal(const Sample& x, const Scaling&) { return x; }
    static constexpr Sample store(const Signal& x) { return x; }
    static constexpr State state(const Scaling&, Structure, int, double value = 0.0) { return static_cast<M>(value); }
    static constexpr Sum no_error(const Scaling&) { return R(0.0); }
    static constexpr Number error(const Sum& sum) { return sum; }
    static constexpr Number worst() {
        if constexpr (std::is_floating_point_v<M>) return std::numeric_limits<M>::max();
        else return M(worst_fitness);
    }
};

// The values of the genes by the bits of their fields, from tables made beforehand, so that no logarithm is needed to decode.
// Every A and B has the same ranges.
template <class Number>
struct GeneValues {
    const Number *gain = nullptr, *real = nullptr, *imaginary = nullptr;
    Number unit[Genome::max_order + 1];  // of K, by p

    const Number& operator()(const Field& f, std::uint32_t bits) const {
        return (f.role == Role::gain ? gain : (f.part == Part::imaginary ? imaginary : real))[bits];
    }
};

template <class A>
Factors<typename A::Number> decode(const Word* c, const Genome& g, const GeneValues<typename A::Number>& values) {
    using Number = typename A::Number;
    return decode<Number>(c, g, values, [&](int p) { return values.unit[p]; });
}

// Runs call(std::integral_constant<int, n>) for a loop of order n up to `most`, so that its states stay in registers; -1 beyond.
template <int most, int n = 1, class Call>
void by_loop_order(int order, Call&& call) {
    if constexpr (n > most) call(std::integral_constant<int, -1>{});
    else if (order == n) call(std::integral_constant<int, n>{});
    else by_loop_order<most, n + 1>(order, call);
}

// sum over n samples of (output - y)^2, from the states x on; `use(y)` sees every output.
template <class A, int N, bool driven, class Use>
typename A::Sum squared_errors(const Delta<typename A::Number>& h, typename A::State* states, const typename A::Sample* input,
                               const typename A::Sample* output, std::size_t samples, const typename A::Scaling& scaling,
                               Use&& use) {
    using Signal = typename A::Signal;
    const int n = N >= 0 ? N : h.order;
    typename A::Number a[room_for(N)], b[room_for(N) + 1];
    typename A::State x[room_for(N)];
    for (int i = 0; i < n; ++i) a[i] = h.a[i];
    for (int i = 0; i <= n; ++i) b[i] = h.b[i];
    for (int i = 0; i < n; ++i) x[i] = states[i];
    typename A::Sum sum = A::no_error(scaling);
    for (std::size_t k = 0; k < samples; ++k) {
        const Signal y = recurrence_step<Signal, N, driven>(n, a, b, x, driven ? A::signal(input[k], scaling) : Signal());
        const Signal e = A::signal(output[k], scaling) - y;
        sum = fma(e, e, sum);
        use(y);
    }
    for (int i = 0; i < n; ++i) states[i] = x[i];
    return sum;
}

// A record as the sample loop takes it.
template <class A>
struct RecordView {
    const typename A::Sample *input, *output;  // where it settles, output is its deviation from the command
    std::size_t samples;
    bool settles;  // under a constant command: the recurrence runs without input
};

// The closed loop's states at the record's beginning: at rest, or from `start` on; where the record settles, their deviations
// from where the constant command takes them.
template <class A>
void begin(const Delta<typename A::Number>& h, Structure s, const RecordView<A>& record, const typename A::Scaling& scaling,
           typename A::State* x, const double* start = nullptr) {
    for (int i = 0; i < h.order; ++i) {
        x[i] = A::state(scaling, s, i, start != nullptr ? start[i] : 0.0);
        if (!record.settles) continue;
        const auto a = [&](int k) -> const typename A::Number& { return h.a[k]; };
        const auto b = [&](int k) -> const typename A::Number& { return h.b[k]; };
        x[i] = x[i] - at_rest(i, a, b) * A::signal(record.input[0], scaling);
    }
}

template <class A>
typename A::Sum squared_errors(const Delta<typename A::Number>& h, typename A::State* x, const RecordView<A>& r,
                               const typename A::Scaling& scaling) {
    typename A::Sum sum = A::no_error(scaling);
    const auto unseen = [](const typename A::Signal&) {};
    by_loop_order<A::orders_in_registers>(h.order, [&](auto N) {
        sum = r.settles ? squared_errors<A, N, false>(h, x, r.input, r.output, r.samples, scaling, unseen)
                        : squared_errors<A, N, true>(h, x, r.input, r.output, r.samples, scaling, unseen);
    });
    return sum;
}

// Equation (6) with Wf1^2 and Wf2 as numbers of the arithmetic.
template <class A>
struct Weights {
    typename A::Number error_squared, order;

    explicit Weights(const FitnessWeights& w = {})
        : error_squared(static_cast<typename A::Number>(w.error * w.error)), order(static_cast<typename A::Number>(w.order)) {}

    typename A::Number fitness(const typename A::Number& error, Structure s) const {
        using Number = typename A::Number;
        if (!(error < A::worst())) return A::worst();
        const Number f = error_squared * error + order * Number(static_cast<double>(s.p + s.q));
        return f < A::worst() ? f : A::worst();
    }
};

}  // namespace gaident
