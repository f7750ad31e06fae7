// The one source of the sample loops; included by one .cpp per instruction set, each with its own tag type.
#pragma once

#include "../../plant/held.hpp"
#include "../../numeric/lanes.hpp"
#include "../../numeric/single.hpp"
#include "../../numeric/unrolled.hpp"
#include "../../control/loop.hpp"
#include "../../control/servo_equation.hpp"
#include "kernels.hpp"
#include "products.hpp"

#include <algorithm>

namespace gaident {

// The factors of a group in registers.
template <class L>
struct LaneFactors {
    Counts sizes;
    L gain, pole, zero, has_excess[max_plant_order];
    Pair<L> pole_pair[max_pairs], zero_pair[max_pairs];

    Counts counts() const { return sizes; }
};

template <class L>
[[gnu::always_inline]] inline L excess(const LaneFactors<L>& g, int i, L factor, L neutral) {
    return where(g.has_excess[i], factor, neutral);
}

template <class Isa>
struct KernelSource {
    // Calls call(std::integral_constant<int, n>) for orders up to `most`, so that everything of that order unrolls and stays in
    // registers; with -1 for larger ones.
    template <int most, int n = 0, class Call>
    static void by_order(int order, Call&& call) {
        if constexpr (n > most) return call(std::integral_constant<int, -1>{});
        else if (order == n) return call(std::integral_constant<int, n>{});
        else return by_order<most, n + 1>(order, call);
    }

    using LD = Lanes<double, double_lanes, Isa>;
    static LaneFactors<LD> factors_of(const FactorGroup& f) {
        using L = LD;
        LaneFactors<L> g;
        g.sizes = f.counts;
        g.gain = L::load(f.gain);
        for (int i = 0; i < f.counts.pole_pairs; ++i) g.pole_pair[i] = {L::load(f.pole_e1[i]), L::load(f.pole_e0[i])};
        for (int i = 0; i < f.counts.zero_pairs; ++i) g.zero_pair[i] = {L::load(f.zero_e1[i]), L::load(f.zero_e0[i])};
        if (f.counts.single_pole) g.pole = L::load(f.pole);
        if (f.counts.single_zero) g.zero = L::load(f.zero);
        for (int i = 0; i < f.counts.p; ++i) g.has_excess[i] = L::load(f.excess[i]);
        return g;
    }

    static void servo_coefficients(const FactorGroup& f, const ServoEquation& servo, DoubleGroup& out) {
        const LaneFactors<LD> g = factors_of(f);
        by_order<6>(f.counts.order, [&](auto constant) {
            constexpr int N = constant;
            if constexpr (N != 0) {
                LD straight[max_loop_order + 1];
                const Delta<LD> h = servo(held_plant<LD, N>(g, servo.period(), f.doublings), straight);
                out.order = h.order;
                for (int i = 0; i < h.order; ++i) h.a[i].store(out.a[i]);
                for (int i = 0; i <= h.order; ++i) h.b[i].store(out.b[i]);
                if (servo.between() != Between::mixed) return;
                for (int i = 0; i <= h.order; ++i) straight[i].store(out.c[i]);
            }
        });
    }

    static void coefficients(const FactorGroup& f, const Loop& loop, double sample_time, bool closed, DoubleGroup& out) {
        using L = LD;
        const LaneFactors<L> g = factors_of(f);
        const auto store = [&](const auto& h, int order) {
            out.order = order;
            for (int i = 0; i < order; ++i) h.a[i].store(out.a[i]);
            for (int i = 0; i <= order; ++i) h.b[i].store(out.b[i]);
        };
        by_order<6>(f.counts.order, [&](auto constant) {
            constexpr int N = constant;
            const int n = N >= 0 ? N : f.counts.order;
            Delta<L, N> plant;
            if (loop.kind == LoopKind::continuous) plant = bilinear_plant<L, N>(g, sample_time);
            else if constexpr (N != 0) plant = held_plant<L, N>(g, sample_time, f.doublings);
            if (closed) store(close_loop(plant, loop.controller, Clock{sample_time}), n + 1);
            else store(plant, n);
        });
    }

    static void words(std::uint64_t base, std::uint64_t* out, std::size_t n) {
        constexpr std::size_t W = Isa::register_bytes / sizeof(std::uint64_t);
        using L = Lanes<std::uint64_t, static_cast<int>(W), Isa>;
        std::uint64_t counters[W];
        for (std::size_t lane = 0; lane < W; ++lane) counters[lane] = base + lane * golden_gamma;
        L counter = L::load(counters);
        std::size_t i = 0;
        for (; i + W <= n; i += W, counter = counter + L::all(W * golden_gamma)) mix(counter).store(out + i);
        for (; i < n; ++i) out[i] = mix(base + i * golden_gamma);
    }

    template <class T, int W, int N>
    struct Bank {  // a group in registers
        using L = Lanes<T, W, Isa>;
        static constexpr int capacity = N >= 0 ? (N > 0 ? N : 1) : max_loop_order;
        L a[capacity], b[capacity + 1], x[capacity];
        int order;

        explicit Bank(const Group<T, W>& g) : order(N >= 0 ? N : g.order) {
            for (int i = 0; i < order; ++i) a[i] = L::load(g.a[i]);
            for (int i = 0; i <= order; ++i) b[i] = L::load(g.b[i]);
            for (int i = 0; i < order; ++i) x[i] = L::load(g.x[i]);
            if (order == 0) x[0] = L(0.0);
        }
        void save(Group<T, W>& g) const {
            for (int i = 0; i < order; ++i) x[i].store(g.x[i]);
        }
    };

    template <class T, int W, int N>
    struct Linear {
        static void outputs(Group<T, W>& g, const T* input, std::size_t n, T* y) {
            using L = Lanes<T, W, Isa>;
            Bank<T, W, N> k(g);
            for (std::size_t i = 0; i < n; ++i) recurrence_step<L, N>(k.order, k.a, k.b, k.x, L::all(input[i])).store(y + i * W);
            k.save(g);
        }
        static void both_outputs(Group<T, W>& g, const T* input, const T* straight, std::size_t n, T* y) {
            using L = Lanes<T, W, Isa>;
            Bank<T, W, N> k(g);
            L c[Bank<T, W, N>::capacity + 1];
            for (int i = 0; i <= k.order; ++i) c[i] = L::load(g.c[i]);
            for (std::size_t i = 0; i < n; ++i)
                recurrence_step<L, N>(k.order, k.a, k.b, c, k.x, L::all(input[i]), L::all(straight[i])).store(y + i * W);
            k.save(g);
        }
    };

    // Squared errors of S registers of candidates side by side, from register `first` of the array of groups on: while one waits for the
    // sample before, the others compute.
    // `order` is the largest of theirs; a register of a smaller one has zeros above its own.
    // `inputs`: 0, outputs being deviations from rest; 1; or 2, the command and its part that goes straight.
    template <class T, int W, int N, int inputs>
    struct SideBySide {
        using L = Lanes<T, static_cast<int>(Isa::register_bytes / sizeof(T)), Isa>;
        static constexpr int per_group = W / L::per_register, capacity = room_for(N);
        template <int S>
        static void errors(Group<T, W>* groups, int first, int order, const T* input, const T* straight, const T* output,
                           std::size_t n, T* sums) {
            constexpr bool driven = inputs > 0;
            L a[S][capacity], b[S][capacity + 1], x[S][capacity], sum[S];
            [[maybe_unused]] L c[inputs == 2 ? S : 1][inputs == 2 ? capacity + 1 : 1];
            const auto lanes = [&](auto& rows, int s, int i) { return rows[i] + (first + s) % per_group * L::per_register; };
            [[maybe_unused]] constexpr int inputs_known = N < 0 ? N : N + 1;
            unrolled<S>(S, [&](int s) [[gnu::always_inline]] {
                Group<T, W>& g = groups[(first + s) / per_group];
                const auto row = [&](auto& rows, int i, int size)
                                     [[gnu::always_inline]] { return i < size ? L::load(lanes(rows, s, i)) : L(0.0); };
                x[s][0] = L(0.0);  // of order 0
                unrolled<N>(order, [&](int i) [[gnu::always_inline]] {
                    a[s][i] = row(g.a, i, g.order);
                    x[s][i] = row(g.x, i, g.order);
                });
                if constexpr (driven)
                    unrolled<inputs_known>(order + 1, [&](int i) [[gnu::always_inline]] { b[s][i] = row(g.b, i, g.order + 1); });
                if constexpr (inputs == 2)
                    unrolled<inputs_known>(order + 1, [&](int i) [[gnu::always_inline]] { c[s][i] = row(g.c, i, g.order + 1); });
                sum[s] = L(0.0);
            });
            for (std::size_t i = 0; i < n; ++i) {
                const L wanted = L::all(output[i]), r = driven ? L::all(input[i]) : L(0.0);
                unrolled<S>(S, [&](int s) [[gnu::always_inline]] {
                    L e;
                    if constexpr (inputs == 2)
                        e = wanted - recurrence_step<L, N>(order, a[s], b[s], c[s], x[s], r, L::all(straight[i]));
                    else e = wanted - recurrence_step<L, N, driven>(order, a[s], b[s], x[s], r);
                    sum[s] = fma(e, e, sum[s]);
                });
            }
            unrolled<S>(S, [&](int s) [[gnu::always_inline]] {
                Group<T, W>& g = groups[(first + s) / per_group];
                unrolled<N>(order, [&](int i) [[gnu::always_inline]] {
                    if (i < g.order) x[s][i].store(lanes(g.x, s, i));
                });
                sum[s].store(sums + (first + s) * L::per_register);
            });
        }
    };

    template <class T, int W, int N>
    struct Stepped {
        using L = Lanes<T, W, Isa>;
        static SteppedLoop<L, N> loop_of(const Group<T, W>& g, const ControllerState<T>& c) {
            SteppedLoop<L, N> loop{ControllerState<L>(Controller{}, Clock{})};
            loop.pi.kp = L::all(c.kp);
            loop.pi.g = L::all(c.g);
            loop.pi.torque_limit = L::all(c.torque_limit);
            loop.pi.integrator_limit = L::all(c.integrator_limit);
            loop.pi.s = L::load(g.s);
            return loop;
        }
        static void errors(Group<T, W>& g, const ControllerState<T>& c, const T* input, const T* output, std::size_t n, T* sums) {
            Bank<T, W, N> k(g);
            SteppedLoop<L, N> loop = loop_of(g, c);
            L sum(0.0), u(0.0);
            for (std::size_t i = 0; i < n; ++i) {
                const L e = L::all(output[i]) - loop.step(k.order, k.a, k.b, k.x, L::all(input[i]), u);
                sum = fma(e, e, sum);
            }
            k.save(g);
            loop.pi.s.store(g.s);
            sum.store(sums);
        }
        static void outputs(Group<T, W>& g, const ControllerState<T>& c, const T* input, std::size_t n, T* y) {
            Bank<T, W, N> k(g);
            SteppedLoop<L, N> loop = loop_of(g, c);
            L u(0.0);
            for (std::size_t i = 0; i < n; ++i) loop.step(k.order, k.a, k.b, k.x, L::all(input[i]), u).store(y + i * W);
            k.save(g);
            loop.pi.s.store(g.s);
        }
    };

    // How many registers run side by side.
    // One alone waits for its own chain from sample to sample, so none stays alone that need not,
    // and registers of different orders share a loop of the larger one.
    // Two hide most of that chain, three all of it up to the order whose states and coefficients fit the registers.
    // Where a fused operation is a call of a function, none is spent on the zeros of a smaller order: pairs only, each of one group.
    template <int inputs>
    static constexpr int three_up_to = inputs == 0 ? 4 : 2;

    template <class T, int W, int inputs>
    static void side_by_side(Group<T, W>* groups, int lanes, const T* input, const T* straight, const T* output, std::size_t n,
                             T* sums) {
        constexpr int per_register = static_cast<int>(Isa::register_bytes / sizeof(T));
        const int registers = (lanes + per_register - 1) / per_register;
        const auto largest = [&](int r, int count) {
            int order = 0;
            for (int k = r; k < r + count; ++k) order = std::max(order, groups[k * per_register / W].order);
            return order;
        };
        for (int r = 0; r < registers;) {
            const int left = registers - r;
            const bool three =
                Lanes<T, per_register, Isa>::Fused::there && (left == 3 || (left > 4 && largest(r, 3) <= three_up_to<inputs>));
            const int s = three ? 3 : std::min(left, 2), order = largest(r, s);
            by_order<8>(order, [&](auto N) {
                using Form = SideBySide<T, W, N, inputs>;
                if (s == 3) Form::template errors<3>(groups, r, order, input, straight, output, n, sums);
                else if (s == 2) Form::template errors<2>(groups, r, order, input, straight, output, n, sums);
                else Form::template errors<1>(groups, r, order, input, straight, output, n, sums);
            });
            r += s;
        }
    }
    template <class T, int W>
    static void errors(Group<T, W>* groups, int lanes, const T* input, const T* output, std::size_t n, T* sums) {
        side_by_side<T, W, 1>(groups, lanes, input, nullptr, output, n, sums);
    }
    template <class T, int W>
    static void settling_errors(Group<T, W>* groups, int lanes, const T* output, std::size_t n, T* sums) {
        side_by_side<T, W, 0>(groups, lanes, nullptr, nullptr, output, n, sums);
    }
    static void both_errors(DoubleGroup* groups, int lanes, const double* input, const double* straight, const double* output,
                            std::size_t n, double* sums) {
        side_by_side<double, double_lanes, 2>(groups, lanes, input, straight, output, n, sums);
    }
    static void both_outputs(DoubleGroup& g, const double* input, const double* straight, std::size_t n, double* y) {
        by_order<8>(g.order, [&](auto N) { Linear<double, double_lanes, N>::both_outputs(g, input, straight, n, y); });
    }
    template <class T, int W>
    static void group_errors(Group<T, W>& g, const T* input, const T* output, std::size_t n, T* sums) {
        errors<T, W>(&g, W, input, output, n, sums);
    }
    template <class T, int W>
    static void outputs(Group<T, W>& g, const T* in, std::size_t n, T* y) {
        by_order<8>(g.order, [&](auto N) { Linear<T, W, N>::outputs(g, in, n, y); });
    }
    template <class T, int W>
    static void stepped_errors(Group<T, W>& g, const ControllerState<T>& c, const T* in, const T* out, std::size_t n, T* sums) {
        by_order<8>(g.order, [&](auto N) { Stepped<T, W, N>::errors(g, c, in, out, n, sums); });
    }
    template <class T, int W>
    static void stepped_outputs(Group<T, W>& g, const ControllerState<T>& c, const T* in, std::size_t n, T* y) {
        by_order<8>(g.order, [&](auto N) { Stepped<T, W, N>::outputs(g, c, in, n, y); });
    }

    template <class T>
    static void alone(AloneRun<T>& given, const double* input, std::size_t n, double* velocity, double* torque) {
        using One = Single<T, Isa>;
        const ControllerState<T>& c = given.controller;
        AloneRun<One> run{given.kind, given.limited, given.order, {}, {}, {}, ControllerState<One>(Controller{}, Clock{})};
        for (int i = 0; i < run.order; ++i) run.a[i] = One::all(given.a[i]);
        for (int i = 0; i <= run.order; ++i) run.b[i] = One::all(given.b[i]);
        for (int i = 0; i < max_loop_order; ++i) run.x[i] = One::all(given.x[i]);
        run.controller.kp = One::all(c.kp);
        run.controller.g = One::all(c.g);
        run.controller.torque_limit = One::all(c.torque_limit);
        run.controller.integrator_limit = One::all(c.integrator_limit);
        run.controller.s = One::all(c.s);
        run_alone(
            run, input, n, [](double x) { return One(x); }, [](One x) { return static_cast<double>(x.v); }, velocity, torque);
        for (int i = 0; i < run.order; ++i) given.x[i] = run.x[i].v;
        given.controller.s = run.controller.s.v;
    }

    template <class T, int W>
    static constexpr KernelSet<Group<T, W>, T> set() {
        return {group_errors<T, W>, errors<T, W>, settling_errors<T, W>, outputs<T, W>, alone<T>};
    }
    static Kernels all(const char* name) {
        using Products = ProductSource<Isa>;
        return {name,
                LD::Fused::there,
                coefficients,
                servo_coefficients,
                words,
                {set<double, double_lanes>(), stepped_errors<double, double_lanes>, stepped_outputs<double, double_lanes>,
                 both_errors, both_outputs},
                set<float, float_lanes>(),
                Products::gram,
                Products::differences,
                Products::whiten,
                Products::colour};
    }
};

}  // namespace gaident
