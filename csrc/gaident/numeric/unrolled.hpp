// work(0), work(1), ..., work(n - 1).
// Where `known`, which is n or -1, is known at compile time the calls are written out,
// so that every index is a constant from the start and an array of registers stays in registers:
// a loop that the compiler unrolls later leaves it in memory, where each sum waits for the store of the sample before.
#pragma once

#include <type_traits>
#include <utility>

namespace gaident {

template <int known, class Work>
[[gnu::always_inline]] inline void unrolled(int n, Work&& work) {
    if constexpr (known >= 0) {
        [&]<int... i>(std::integer_sequence<int, i...>)
            [[gnu::always_inline]] { (work(std::integral_constant<int, i>{}), ...); }(std::make_integer_sequence<int, known>{});
    } else {
        for (int i = 0; i < n; ++i) work(i);
    }
}

}  // namespace gaident
