// How long work is ended from outside: it looks at a flag now and then.
#pragma once

#include <atomic>

namespace gaident {

// Thrown where the flag is seen; the caller asked for it.
struct Stopped {};

// `stop` may be null: then nobody asks.
inline void stop_if_asked(const std::atomic<bool>* stop) {
    if (stop != nullptr && stop->load(std::memory_order_relaxed)) throw Stopped{};
}

}  // namespace gaident
