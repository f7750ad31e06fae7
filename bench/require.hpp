// What a row of the benchmark checks before it times anything.
#pragma once

#include <cstdio>
#include <cstdlib>

inline void require(bool right, const char* what) {
    if (right) return;
    std::fprintf(stderr, "gaident_bench: wrong answer: %s\n", what);
    std::exit(1);
}
