#include "kernel.hpp"

namespace gaident {

namespace {
struct Isa_baseline {};
}  // namespace

const Kernels& baseline_kernels() {
    static const Kernels kernels = KernelSource<Isa_baseline>::all("baseline");
    return kernels;
}

}  // namespace gaident
