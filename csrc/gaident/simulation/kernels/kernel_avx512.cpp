#include "kernel.hpp"

namespace gaident {

namespace {
struct Isa_avx512 {
    static constexpr int register_bytes = 64;
    static constexpr int side_by_side = 3;
};
}  // namespace

const Kernels& avx512_kernels() {
    static const Kernels kernels = KernelSource<Isa_avx512>::all("avx512");
    return kernels;
}

}  // namespace gaident
