// A small test harness, standard library only.
//
//     TEST_CASE("decode: a pair of real genes gives two real poles") {
//         CHECK(n == 2);                        // goes on after a failure
//         CHECK_NEAR(poles[0], -15.41, 1e-12);  // absolute tolerance; a NaN never passes
//         CHECK_THROWS(decode({}), std::invalid_argument);
//     }
//
// One program per test file: `test_decode --list` names its cases, `test_decode pair real` runs those whose names
// contain "pair" or "real". Exit code 0: all passed; 1: a check failed or a case threw; 2: no case of that name.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

namespace check {

struct Case {
    const char* name;
    void (*body)();
};

inline std::vector<Case>& cases() {
    static std::vector<Case> all;
    return all;
}

inline std::atomic<int> failures{0};

inline bool add(const char* name, void (*body)()) {
    cases().push_back({name, body});
    return true;
}

inline void fail(const char* file, int line, const std::string& what) {
    constexpr int shown = 50;  // a failing loop shall not bury the first message
    if (const int count = ++failures; count <= shown) std::printf("%s:%d: %s\n", file, line, what.c_str());
}

inline void near(const char* file, int line, const char* text, double value, double expected, double tolerance) {
    if (std::abs(value - expected) <= tolerance || value == expected) return;  // ==: equal infinities
    char numbers[160];
    std::snprintf(numbers, sizeof numbers, "%.17g is not within %.3g of %.17g", value, tolerance, expected);
    fail(file, line, std::string(text) + ": " + numbers);
}

inline int run(const std::vector<std::string>& arguments) {
    const bool list = arguments.size() == 1 && arguments[0] == "--list";
    int ran = 0;
    for (const Case& c : cases()) {
        bool wanted = list || arguments.empty();
        for (const std::string& part : arguments)
            wanted = wanted || std::string(c.name).find(part) != std::string::npos;
        if (!wanted) continue;
        ++ran;
        std::printf(list ? "%s\n" : "[ %s ]\n", c.name);
        if (list) continue;
        try {
            c.body();
        } catch (const std::exception& error) {
            fail(c.name, 0, std::string("threw ") + error.what());
        } catch (...) {
            fail(c.name, 0, "threw something that is no std::exception");
        }
    }
    if (!list) std::printf("%d cases, %d failed checks\n", ran, failures.load());
    return ran == 0 ? 2 : failures > 0 ? 1 : 0;
}

}  // namespace check

#define CHECK_JOIN_(a, b) a##b
#define CHECK_JOIN(a, b) CHECK_JOIN_(a, b)
#define TEST_CASE(name)                                               \
    static void CHECK_JOIN(test_case_, __LINE__)();                   \
    [[maybe_unused]] static const bool CHECK_JOIN(added_, __LINE__) = \
        check::add(name, &CHECK_JOIN(test_case_, __LINE__));          \
    static void CHECK_JOIN(test_case_, __LINE__)()
#define CHECK(...)                                                                      \
    do {                                                                                \
        if (!(__VA_ARGS__)) check::fail(__FILE__, __LINE__, "CHECK(" #__VA_ARGS__ ")"); \
    } while (false)
#define CHECK_NEAR(value, expected, tolerance)                                                           \
    check::near(__FILE__, __LINE__, "CHECK_NEAR(" #value ", " #expected ")", static_cast<double>(value), \
                static_cast<double>(expected), static_cast<double>(tolerance))
#define CHECK_THROWS(expression, exception_type)                                                             \
    do {                                                                                                     \
        bool thrown_ = false;                                                                                \
        try {                                                                                                \
            static_cast<void>(expression);                                                                   \
        } catch (const exception_type&) {                                                                    \
            thrown_ = true;                                                                                  \
        }                                                                                                    \
        if (!thrown_) check::fail(__FILE__, __LINE__, "CHECK_THROWS(" #expression ", " #exception_type ")"); \
    } while (false)
