// The bits of one type as another of the same size: std::bit_cast, which the C++ library of Emscripten 3.1 does not have.
// The compilers that the core is written for have the operation itself.
#pragma once

namespace gaident {

template <class To, class From>
[[gnu::always_inline]] constexpr To bit_cast(const From& from) noexcept {
    static_assert(sizeof(To) == sizeof(From));
    return __builtin_bit_cast(To, from);
}

}  // namespace gaident
