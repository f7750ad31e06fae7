#include "kernel.hpp"

namespace gaident {

namespace {
struct Isa_avx512 {};
}  // namespace

const Kernels& avx512_kernels() {
    static const Kernels kernels = KernelSource<Isa_avx512>::all("avx512");
    return kernels;
}

}  // namespace gaident
