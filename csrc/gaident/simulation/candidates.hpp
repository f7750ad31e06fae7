// What a batch simulates: candidates by their number, wherever their factors come from.
#pragma once

#include "kernels/kernels.hpp"

namespace gaident {

class Candidates {
public:
    virtual std::size_t size() const = 0;
    virtual void structures(Structure* all) const = 0;  // size() of them
    virtual Factors<double> factors(std::size_t i) const = 0;
    // Writes candidate index[lane] into each lane of the group, whose `counts` say how many factors it has; those that a
    // candidate lacks are set to zero. s[0], s[1], ..., s[count - 1]: structures of the first lanes; the others repeat the last.
    virtual void place(const std::size_t* index, const Structure* s, std::size_t count, FactorGroup& group) const = 0;

protected:
    ~Candidates() = default;
};

// Calls write(first, last) for each range of lanes of one structure.
template <class Write>
void by_structure(const Structure* s, std::size_t count, Write&& write) {
    for (std::size_t first = 0; first < count;) {
        std::size_t last = first + 1;
        while (last < count && s[last] == s[first]) ++last;
        write(first, last < count ? last : FactorGroup::width);
        first = last;
    }
}

}  // namespace gaident
