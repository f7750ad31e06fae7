#include "parallel.hpp"

#include "denormals.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace gaident {

void parallel(std::size_t n, int workers, const std::function<void(std::size_t)>& work) {
    const std::size_t threads = std::min(n, static_cast<std::size_t>(std::max(1, workers)));
    std::atomic<std::size_t> next{0};
    std::exception_ptr error;
    std::mutex lock;
    const auto loop = [&] {
        const FlushDenormals flush;
        for (std::size_t i = next++; i < n; i = next++) {
            try {
                work(n - 1 - i);
            } catch (...) {
                const std::lock_guard<std::mutex> guard(lock);
                if (!error) error = std::current_exception();
                next = n;
            }
        }
    };
    std::vector<std::jthread> pool;
    try {
        for (std::size_t t = 1; t < threads; ++t) pool.emplace_back(loop);
    } catch (const std::system_error&) {
        // The machine gives no more threads: those there are do the work, to the same result.
    }
    loop();
    pool.clear();
    if (error) std::rethrow_exception(error);
}

}  // namespace gaident
