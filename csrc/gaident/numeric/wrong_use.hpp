// Wrong use of the core throws, and in a drive, which has no exceptions, stops the program where a debugger sees it.
#pragma once

#if __STDC_HOSTED__
#include <stdexcept>
#endif

namespace gaident {

[[noreturn]] inline void wrong_use([[maybe_unused]] const char* what) {
#if __STDC_HOSTED__
    throw std::invalid_argument(what);
#else
    __builtin_trap();
#endif
}

}  // namespace gaident
