// The one source of the sample loops; included by one .cpp per instruction set, each with its own tag type.
#pragma once

#include "../lanes.hpp"
#include "../loop.hpp"
#include "kernels.hpp"
#include "products.hpp"

namespace gaident {

// The factors of a group in registers.
template <class L>
struct LaneFactors : Factors<L> {
    Counts sizes{};
    L has_excess[max_plant_order];

    Counts counts() const { return sizes; }
};

template <class L>
[[gnu::always_inline]] inline L excess(const LaneFactors<L>& g, int i, L factor, L neutral) {
    return where(g.has_excess[i], factor, neutral);
}

template <class Isa>
struct KernelSource {
    static void coefficients(const FactorGroup& f, const Loop& loop, double sample_time, bool closed, DoubleGroup& out) {
        using L = Lanes<double, double_lanes, Isa>;
        LaneFactors<L> g;
        g.structure = f.structure;
        g.sizes = f.counts;
        g.gain = L::load(f.gain);
        for (int i = 0; i < f.counts.pole_pairs; ++i) g.pole_pair[i] = {L::load(f.pole_e1[i]), L::load(f.pole_e0[i])};
        for (int i = 0; i < f.counts.zero_pairs; ++i) g.zero_pair[i] = {L::load(f.zero_e1[i]), L::load(f.zero_e0[i])};
        if (f.counts.single_pole) g.pole = L::load(f.pole);
        if (f.counts.single_zero) g.zero = L::load(f.zero);
        for (int i = 0; i < f.counts.p; ++i) g.has_excess[i] = L::load(f.excess[i]);
        Delta<L> h =
            loop.kind == LoopKind::continuous ? bilinear_plant<L>(g, sample_time) : held_plant<L>(g, sample_time, f.doublings);
        if (closed) h = close_loop(h, loop.kp, loop.ki, sample_time);
        out.order = h.order;
        for (int i = 0; i < h.order; ++i) h.a[i].store(out.a[i]);
        for (int i = 0; i <= h.order; ++i) h.b[i].store(out.b[i]);
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
        static void errors(Group<T, W>& g, const T* input, const T* output, std::size_t n, T* sums) {
            using L = Lanes<T, W, Isa>;
            Bank<T, W, N> k(g);
            L sum(0.0);
            for (std::size_t i = 0; i < n; ++i) {
                const L e = L::all(output[i]) - recurrence_step<L, N>(k.order, k.a, k.b, k.x, L::all(input[i]));
                sum = sum + e * e;
            }
            k.save(g);
            sum.store(sums);
        }
        static void outputs(Group<T, W>& g, const T* input, std::size_t n, T* y) {
            using L = Lanes<T, W, Isa>;
            Bank<T, W, N> k(g);
            for (std::size_t i = 0; i < n; ++i) recurrence_step<L, N>(k.order, k.a, k.b, k.x, L::all(input[i])).store(y + i * W);
            k.save(g);
        }
    };

    template <class T, int W, int N>
    struct Stepped {
        using L = Lanes<T, W, Isa>;
        static SteppedLoop<L, N> loop_of(const Group<T, W>& g, const Controller<T>& c) {
            SteppedLoop<L, N> loop{Controller<L>(Loop{}, 0.0)};
            loop.pi.kp = L::all(c.kp);
            loop.pi.g = L::all(c.g);
            loop.pi.torque_limit = L::all(c.torque_limit);
            loop.pi.integrator_limit = L::all(c.integrator_limit);
            loop.pi.s = L::load(g.s);
            return loop;
        }
        static void errors(Group<T, W>& g, const Controller<T>& c, const T* input, const T* output, std::size_t n, T* sums) {
            Bank<T, W, N> k(g);
            SteppedLoop<L, N> loop = loop_of(g, c);
            L sum(0.0), u(0.0);
            for (std::size_t i = 0; i < n; ++i) {
                const L e = L::all(output[i]) - loop.step(k.order, k.a, k.b, k.x, L::all(input[i]), u);
                sum = sum + e * e;
            }
            k.save(g);
            loop.pi.s.store(g.s);
            sum.store(sums);
        }
        static void outputs(Group<T, W>& g, const Controller<T>& c, const T* input, std::size_t n, T* y) {
            Bank<T, W, N> k(g);
            SteppedLoop<L, N> loop = loop_of(g, c);
            L u(0.0);
            for (std::size_t i = 0; i < n; ++i) loop.step(k.order, k.a, k.b, k.x, L::all(input[i]), u).store(y + i * W);
            k.save(g);
            loop.pi.s.store(g.s);
        }
    };

    // Orders up to 8 have a loop of their own, with the states in registers.
    template <template <class, int, int> class Form, class T, int W, class Call>
    static void by_order(int order, Call&& call) {
        switch (order) {
            case 0: return call(Form<T, W, 0>{});
            case 1: return call(Form<T, W, 1>{});
            case 2: return call(Form<T, W, 2>{});
            case 3: return call(Form<T, W, 3>{});
            case 4: return call(Form<T, W, 4>{});
            case 5: return call(Form<T, W, 5>{});
            case 6: return call(Form<T, W, 6>{});
            case 7: return call(Form<T, W, 7>{});
            case 8: return call(Form<T, W, 8>{});
            default: return call(Form<T, W, -1>{});
        }
    }

    template <class T, int W>
    static void errors(Group<T, W>& g, const T* in, const T* out, std::size_t n, T* sums) {
        by_order<Linear, T, W>(g.order, [&](auto form) { form.errors(g, in, out, n, sums); });
    }
    template <class T, int W>
    static void outputs(Group<T, W>& g, const T* in, std::size_t n, T* y) {
        by_order<Linear, T, W>(g.order, [&](auto form) { form.outputs(g, in, n, y); });
    }
    template <class T, int W>
    static void stepped_errors(Group<T, W>& g, const Controller<T>& c, const T* in, const T* out, std::size_t n, T* sums) {
        by_order<Stepped, T, W>(g.order, [&](auto form) { form.errors(g, c, in, out, n, sums); });
    }
    template <class T, int W>
    static void stepped_outputs(Group<T, W>& g, const Controller<T>& c, const T* in, std::size_t n, T* y) {
        by_order<Stepped, T, W>(g.order, [&](auto form) { form.outputs(g, c, in, n, y); });
    }

    template <class T, int W>
    static constexpr KernelSet<Group<T, W>, T> set() {
        return {errors<T, W>, outputs<T, W>};
    }
    static Kernels all(const char* name) {
        using Products = ProductSource<Isa>;
        return {name,
                coefficients,
                {set<double, double_lanes>(), stepped_errors<double, double_lanes>, stepped_outputs<double, double_lanes>},
                set<float, float_lanes>(),
                Products::gram,
                Products::differences,
                Products::whiten,
                Products::colour};
    }
};

}  // namespace gaident
