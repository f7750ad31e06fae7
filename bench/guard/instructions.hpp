// How many instructions a piece of code executes, counted by the processor's trap flag: with it set every instruction ends in a
// trap, which Linux hands over as SIGTRAP.
// Slow (about a microsecond each) and the same at every run, whatever else the machine does.
// An iteration of a repeated string instruction traps too, at the same address: such an instruction counts once.
#pragma once

#include <csignal>
#include <cstdint>
#include <stdexcept>
#include <ucontext.h>

namespace guard {

namespace trap {

inline volatile std::uint64_t count = 0;
inline volatile std::int64_t last = 0;

inline void handler(int, siginfo_t*, void* context) {
    const std::int64_t at = static_cast<const ucontext_t*>(context)->uc_mcontext.gregs[REG_RIP];
    if (at != last) count = count + 1;
    last = at;
}

constexpr unsigned long long flag = 0x100;

}  // namespace trap

// Only for code of one thread. Throws std::runtime_error where SIGTRAP cannot be handled.
std::uint64_t instructions(auto&& call) {
    struct sigaction now{}, before{};
    now.sa_sigaction = trap::handler;
    now.sa_flags = SA_SIGINFO;
    if (sigaction(SIGTRAP, &now, &before) != 0) throw std::runtime_error("SIGTRAP cannot be handled");
    trap::count = 0;
    __builtin_ia32_writeeflags_u64(__builtin_ia32_readeflags_u64() | trap::flag);
    call();
    __builtin_ia32_writeeflags_u64(__builtin_ia32_readeflags_u64() & ~trap::flag);
    sigaction(SIGTRAP, &before, nullptr);
    return trap::count;
}

}  // namespace guard
