#include "parallel.hpp"

#include "../numeric/denormals.hpp"

#include <algorithm>
#include <exception>
#include <limits>
#include <system_error>

namespace gaident {

// Guarded by the mutex.
struct Workers::Job {
    std::size_t to_begin;  // pieces 0 .. to_begin - 1 have not begun
    const Work& work;
    std::size_t running = 0;
    std::exception_ptr error;
};

Workers::Workers(int count) : count_(static_cast<std::size_t>(std::max(1, count))) {}

Workers::~Workers() {
    {
        const std::lock_guard<std::mutex> guard(mutex_);
        closed_ = true;
        announce();
    }
    for (std::thread& t : helpers_) t.join();
}

void Workers::share(std::size_t n, const Work& work) {
    const FlushDenormals flush;
    if (count_ == 1 || n <= 1) {
        while (n > 0) work(--n);
        return;
    }
    Job job{n, work, 0, nullptr};
    std::unique_lock<std::mutex> lock(mutex_);
    start();
    jobs_.push_back(&job);
    announce();
    while (piece(job, lock)) {
    }
    // What others still have under way may have been shared in turn.
    // Work that is older than this may take far longer than this does.
    while (job.running > 0)
        if (!piece_after(&job, lock)) await_news(lock);
    jobs_.erase(std::find(jobs_.begin(), jobs_.end(), &job));
    if (job.error) std::rethrow_exception(job.error);
}

void Workers::share_strands(std::size_t strands, std::size_t steps, const std::function<void(std::size_t, std::size_t)>& work) {
    constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
    std::vector<std::size_t> done(strands, 0);
    std::vector<char> busy(strands, 0);
    std::mutex lock;
    // The strand with the fewest steps done, of those that no thread works on.
    const auto next = [&] {
        std::size_t found = none;
        for (std::size_t s = 0; s < strands; ++s)
            if (busy[s] == 0 && done[s] < steps && (found == none || done[s] < done[found])) found = s;
        return found;
    };
    // A thread that finds no strand ends: each strand has a worker already, which stays to the end.
    share(std::min(strands, count_), [&](std::size_t) {
        std::unique_lock<std::mutex> guard(lock);
        for (std::size_t s = next(); s != none; s = next()) {
            busy[s] = 1;
            guard.unlock();
            work(s, done[s]);
            guard.lock();
            ++done[s];
            busy[s] = 0;
        }
    });
}

void Workers::start() {
    try {
        while (helpers_.size() + 1 < count_) helpers_.emplace_back([this] { help(); });
    } catch (const std::system_error&) {
        // The machine gives no more threads: those there are do the work, to the same result.
        count_ = helpers_.size() + 1;
    }
}

void Workers::help() {
    const FlushDenormals flush;
    std::unique_lock<std::mutex> lock(mutex_);
    while (!closed_)
        if (!piece_after(nullptr, lock)) await_news(lock);
}

// Does a piece of the job; false where all have begun.
bool Workers::piece(Job& job, std::unique_lock<std::mutex>& lock) {
    if (job.to_begin == 0) return false;
    const std::size_t i = --job.to_begin;
    ++job.running;
    lock.unlock();
    std::exception_ptr error;
    try {
        job.work(i);
    } catch (...) {
        error = std::current_exception();
    }
    lock.lock();
    if (error) {
        if (!job.error) job.error = error;
        job.to_begin = 0;
    }
    if (--job.running == 0 && job.to_begin == 0) announce();
    return true;
}

// Does a piece of the oldest job that has one, its pieces being the largest, of those begun after `job`.
bool Workers::piece_after(const Job* job, std::unique_lock<std::mutex>& lock) {
    const auto first = job == nullptr ? jobs_.begin() : std::find(jobs_.begin(), jobs_.end(), job) + 1;
    const auto found = std::find_if(first, jobs_.end(), [](const Job* j) { return j->to_begin > 0; });
    return found != jobs_.end() && piece(**found, lock);
}

void Workers::announce() {
    ++edition_;
    news_.notify_all();
}

// Polls for some ten microseconds, in which a generation's serial part is over, before it sleeps: waking a thread takes longer.
void Workers::await_news(std::unique_lock<std::mutex>& lock) {
    constexpr int glances = 64;
    const unsigned seen = edition_;
    lock.unlock();
    for (int i = 0; i < glances && edition_ == seen; ++i) std::this_thread::yield();
    lock.lock();
    news_.wait(lock, [&] { return edition_ != seen; });
}

}  // namespace gaident
