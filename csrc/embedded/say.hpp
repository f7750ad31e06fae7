// Lines of text without a library.
#pragma once

#include "board.h"

#include <cstdint>

class Line {
public:
    Line& operator<<(const char* s) {
        while (*s != '\0') put(*s++);
        return *this;
    }
    Line& operator<<(std::uint64_t n) {
        char digits[20];
        int k = 0;
        do digits[k++] = static_cast<char>('0' + n % 10);
        while ((n /= 10) > 0);
        while (k > 0) put(digits[--k]);
        return *this;
    }
    Line& hex(std::uint64_t n) {
        for (int shift = 60; shift >= 0; shift -= 4) put("0123456789abcdef"[n >> shift & 15]);
        return *this;
    }
    void say() {
        text_[n_] = '\0';
        n_ = 0;
        board_say(text_);
    }

private:
    void put(char c) {
        text_[n_] = c;
        if (n_ + 1 < static_cast<int>(sizeof text_) - 1) ++n_;
    }
    char text_[260] = {};
    int n_ = 0;
};
