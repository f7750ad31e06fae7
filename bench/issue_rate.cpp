// Compiled once per instruction set: ISSUE_RATE is the function's name, REGISTER_BYTES the width.
#include "issue_rate.hpp"

#include "../csrc/gaident/numeric/lanes.hpp"

#include <algorithm>
#include <ctime>

namespace {

struct Isa {
    static constexpr int register_bytes = REGISTER_BYTES;
};

// `multiply` of twelve independent registers are multiplied in every turn, the others added to.
template <class T, int multiply>
double rate() {
    constexpr int W = REGISTER_BYTES / static_cast<int>(sizeof(T)), registers = 12, turns = 100000;
    using L = gaident::Lanes<T, W, Isa>;
    volatile double factor = 1.0 - 1e-7;
    const L c(factor);
    double best = 0.0;
    for (int repeat = 0; repeat < 15; ++repeat) {
        L x[registers];
        for (L& r : x) r = L(factor);
        const std::clock_t start = std::clock();
        for (int turn = 0; turn < turns; ++turn) {
#pragma GCC unroll 12
            for (int k = 0; k < registers; ++k) x[k] = k < multiply ? x[k] * c : x[k] + c;
        }
        const double seconds = static_cast<double>(std::clock() - start + 1) / CLOCKS_PER_SEC;
        T kept[W];
        for (int k = 1; k < registers; ++k) x[0] = x[0] + x[k];
        x[0].store(kept);
        volatile T sink = kept[0];
        (void)sink;
        best = std::max(best, static_cast<double>(W) * registers * turns / seconds);
    }
    return best;
}

}  // namespace

IssueRate ISSUE_RATE(bool in_float) {
    if (in_float) return {rate<float, 12>(), rate<float, 0>(), rate<float, 6>()};
    return {rate<double, 12>(), rate<double, 0>(), rate<double, 6>()};
}
