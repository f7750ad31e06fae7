#include "kernel.hpp"

namespace gaident {

namespace {
struct Isa_avx512 {
    static constexpr int register_bytes = 64;
};
}  // namespace

const Kernels& avx512_kernels() {
    static const Kernels kernels = KernelSource<Isa_avx512>::all("avx512");
    return kernels;
}

}  // namespace gaident
