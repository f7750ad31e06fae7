// Threads: for independent pieces of work only (trials, species, models to be fitted, candidates of a long record), never inside
// one small generation.
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace gaident {

// The calling thread and its helpers. What is shared must not depend on who does it: then no result depends on their number.
class Workers {
public:
    // `count` in all, the caller included; the helpers start with the first work that is shared and end with this object.
    explicit Workers(int count);
    ~Workers();
    Workers(const Workers&) = delete;

    // Calls work(0) ... work(n-1), denormals flushed; the first exception is thrown again here.
    // The last is begun first: callers list small structures before large ones, and long work begun late leaves the other threads
    // idle. A piece may share work itself.
    using Work = std::function<void(std::size_t)>;
    void share(std::size_t n, const Work& work);

    // Calls work(strand, 0) ... work(strand, steps-1) of every strand, one strand's steps one after the other but by whoever is
    // free: so three equal strands keep two threads busy to the end.
    void share_strands(std::size_t strands, std::size_t steps, const std::function<void(std::size_t, std::size_t)>& work);

    // So many threads have begun beside the caller's.
    std::size_t helpers() const { return helpers_.size(); }

private:
    struct Job;

    void start();
    void help();
    bool piece(Job& job, std::unique_lock<std::mutex>& lock);
    bool piece_after(const Job* job, std::unique_lock<std::mutex>& lock);
    void announce();
    void await_news(std::unique_lock<std::mutex>& lock);

    std::size_t count_;
    std::mutex mutex_;
    std::condition_variable news_;
    std::atomic<unsigned> edition_{0};  // changes with every piece of news
    std::vector<Job*> jobs_;            // under way, the newest last
    bool closed_ = false;
    std::vector<std::thread> helpers_;
};

// The same for one piece of sharing.
inline void parallel(std::size_t n, int workers, const Workers::Work& work) {
    Workers(static_cast<int>(std::min(n, static_cast<std::size_t>(std::max(1, workers))))).share(n, work);
}

}  // namespace gaident
