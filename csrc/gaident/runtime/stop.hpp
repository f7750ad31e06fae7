// How long work is ended from outside: it looks at a flag now and then.
#pragma once

#include <atomic>
#include <cstddef>

namespace gaident {

// Samples of one linear simulation between two looks at the flag: some milliseconds in the slowest arithmetic.
inline constexpr std::size_t samples_between_stops = 8192;

// Thrown where the flag is seen; the caller asked for it.
struct Stopped {};

// `stop` may be null: then nobody asks.
inline void stop_if_asked(const std::atomic<bool>* stop) {
    if (stop != nullptr && stop->load(std::memory_order_relaxed)) throw Stopped{};
}

}  // namespace gaident
