// A value that follows another with at most so much change a sample.
#pragma once

#include "../numeric/elementary.hpp"

namespace gaident {

// r'(n) = r'(n-1) + clip(r(n) - r'(n-1), +-step), before = r'(n-1)
template <class R>
[[gnu::always_inline]] inline R follow(R step, R r, R before) {
    return before + clamp(r - before, -step, step);
}

}  // namespace gaident
