// The sample loops over many candidates, compiled once per instruction set and chosen when the program starts.
//
// A Group is W candidates of one order, coefficients and states lane by lane; a kernel advances it over n samples, from where its
// states stand, so a long record is run in chunks. Candidates of a lower order than the group's have zeros at the end.
#pragma once

#include "../alone.hpp"
#include "../../numeric/rng.hpp"

namespace gaident {

class ServoEquation;

template <class T, int W>
struct Group {
    static constexpr int width = W;
    int order = 0;
    alignas(64) T a[max_loop_order][W];
    alignas(64) T b[max_loop_order + 1][W];
    alignas(64) T c[max_loop_order + 1][W];  // of a second input
    alignas(64) T x[max_loop_order][W];
    alignas(64) T s[W];  // the controller's stored torque, in the stepped loop
};

inline constexpr int double_lanes = 8;
inline constexpr int float_lanes = 16;
using DoubleGroup = Group<double, double_lanes>;
using FloatGroup = Group<float, float_lanes>;

// W plants as factors, lane by lane.
// Lanes of a smaller structure leave at zero the factors they lack: bilinear, s^2 and s over their powers of (delta + 2) are the
// identity, so that mixed structures share a group.
// Behind a hold they are not, and a group has one structure.
struct FactorGroup {
    static constexpr int width = double_lanes;
    Structure structure;  // of all lanes, behind a hold
    Counts counts{};      // of the product: the largest of the lanes
    alignas(64) double gain[width];
    alignas(64) double pole_e1[max_pairs][width], pole_e0[max_pairs][width], pole[width];
    alignas(64) double zero_e1[max_pairs][width], zero_e0[max_pairs][width], zero[width];
    alignas(64) double excess[max_plant_order][width];  // 1 where the lane has more than i poles in excess of zeros, else 0
    int doublings = 0;                                  // of the hold's matrix exponential, enough for the fastest lane
};

template <class G, class T>
struct KernelSet {
    // sums[lane] = sum over n samples of (output - y)^2
    void (*errors)(G&, const T* input, const T* output, std::size_t n, T* sums);
    // The same for the first `lanes` lanes of an array of groups, sorted by order, several registers side by side.
    void (*many_errors)(G* groups, int lanes, const T* input, const T* output, std::size_t n, T* sums);
    // The same where the command is constant: states and output are deviations from rest (batch.cpp).
    void (*settling_errors)(G* groups, int lanes, const T* output, std::size_t n, T* sums);
    // y[sample][lane]
    void (*outputs)(G&, const T* input, std::size_t n, T* y);
    // One candidate.
    void (*alone)(AloneRun<T>&, const double* input, std::size_t n, double* velocity, double* torque);
};

// The same with the controller's limits, the group of plants and not closed loops; and with two inputs.
struct SteppedKernelSet : KernelSet<DoubleGroup, double> {
    void (*stepped_errors)(DoubleGroup&, const ControllerState<double>&, const double* input, const double* output, std::size_t n,
                           double* sums);
    void (*stepped_outputs)(DoubleGroup&, const ControllerState<double>&, const double* input, std::size_t n, double* y);
    void (*both_errors)(DoubleGroup* groups, int lanes, const double* input, const double* straight, const double* output,
                        std::size_t n, double* sums);
    void (*both_outputs)(DoubleGroup&, const double* input, const double* straight, std::size_t n, double* y);
};

struct Kernels {
    const char* name;
    bool fused;  // products and sums by the processor, not by calls of the C library
    // Coefficients of the plants (`closed` false) or of the closed loops into the group's a, b and order; its states are left
    // alone.
    void (*coefficients)(const FactorGroup&, const Loop&, double sample_time, bool closed, DoubleGroup&);
    // Of the loops of a servo axis from line to line of a log, c for the part of the command that goes straight.
    void (*servo_coefficients)(const FactorGroup&, const ServoEquation&, DoubleGroup&);
    // Random words: out[i] = mix(base + i * golden_gamma).
    WordStream::Fill words;
    SteppedKernelSet in_double;
    KernelSet<FloatGroup, float> in_float;
    // Rows of double_lanes numbers, see products.hpp.
    void (*gram)(const double* a, const double* b, std::size_t n, double* sums);
    void (*differences)(const double* scale, const double* output, std::size_t n, double* rows);
    void (*whiten)(const double* phi, std::size_t order, const double* in, std::size_t n, double* out);
    void (*colour)(const double* phi, std::size_t order, const double* in, std::size_t n, double* z);
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
