// Threads: for independent pieces of work only (trials, species, models to be fitted), never inside one small generation.
#pragma once

#include <cstddef>
#include <functional>

namespace gaident {

// Calls work(0) ... work(n-1) on up to `workers` threads, denormals flushed; the first exception is thrown again here. The last is begun
// first: callers list small structures before large ones, and long work begun late leaves the other threads idle.
void parallel(std::size_t n, int workers, const std::function<void(std::size_t)>& work);

}  // namespace gaident
