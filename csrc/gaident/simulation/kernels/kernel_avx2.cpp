#include "kernel.hpp"

namespace gaident {

namespace {
struct Isa_avx2 {
    static constexpr int register_bytes = 32;
};
}  // namespace

const Kernels& avx2_kernels() {
    static const Kernels kernels = KernelSource<Isa_avx2>::all("avx2");
    return kernels;
}

}  // namespace gaident
