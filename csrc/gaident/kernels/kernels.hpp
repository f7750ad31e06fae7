// The sample loops over many candidates, compiled once per instruction set and chosen when the program starts.
//
// A Group is W candidates of one order, coefficients and states lane by lane; a kernel advances it over n samples, from where its
// states stand, so a long record is run in chunks. Candidates of a lower order than the group's have zeros at the end.
#pragma once

#include "../controller.hpp"

namespace gaident {

template <class T, int W>
struct Group {
    static constexpr int width = W;
    int order = 0;
    alignas(64) T a[max_loop_order][W];
    alignas(64) T b[max_loop_order + 1][W];
    alignas(64) T x[max_loop_order][W];
    alignas(64) T s[W];  // the controller's stored torque, in the stepped loop
};

inline constexpr int double_lanes = 8;
inline constexpr int float_lanes = 16;
using DoubleGroup = Group<double, double_lanes>;
using FloatGroup = Group<float, float_lanes>;

template <class G, class T>
struct KernelSet {
    // sums[lane] = sum over n samples of (output - y)^2
    void (*errors)(G&, const T* input, const T* output, std::size_t n, T* sums);
    // y[sample][lane]
    void (*outputs)(G&, const T* input, std::size_t n, T* y);
    // The same with the controller's limits, the group holding plants and not closed loops.
    void (*stepped_errors)(G&, const Controller<T>&, const T* input, const T* output, std::size_t n, T* sums);
    void (*stepped_outputs)(G&, const Controller<T>&, const T* input, std::size_t n, T* y);
};

struct Kernels {
    const char* name;
    KernelSet<DoubleGroup, double> in_double;
    KernelSet<FloatGroup, float> in_float;
};

const Kernels& baseline_kernels();
#ifdef GAIDENT_HAVE_X86_KERNELS
const Kernels& avx2_kernels();
const Kernels& avx512_kernels();
#endif

// The best set this machine can run.
const Kernels& best_kernels();
// By name ("baseline", "avx2", "avx512"); nullptr where not built or not runnable here.
const Kernels* kernels_named(const char* name);

}  // namespace gaident
