#include "kernel.hpp"

namespace gaident {

namespace {
struct Isa_baseline {
    static constexpr int register_bytes = 16;
};
}  // namespace

const Kernels& baseline_kernels() {
    static const Kernels kernels = KernelSource<Isa_baseline>::all("baseline");
    return kernels;
}

}  // namespace gaident
