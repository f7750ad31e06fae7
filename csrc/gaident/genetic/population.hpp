// A population as one flat array.
#pragma once

#include "chromosome.hpp"

#include <span>
#include <stdexcept>
#include <vector>

namespace gaident {

// `count` chromosomes of `words` words each, one after the other.
class Population {
public:
    Population(std::size_t count, int words) : words_(words), data_(count * static_cast<std::size_t>(words)) {
        if (count == 0 || words < 1) throw std::invalid_argument("Population: count and words must be at least 1");
    }
    Word* operator[](std::size_t i) { return data_.data() + i * static_cast<std::size_t>(words_); }
    const Word* operator[](std::size_t i) const { return data_.data() + i * static_cast<std::size_t>(words_); }
    std::size_t size() const { return data_.size() / static_cast<std::size_t>(words_); }
    int words() const { return words_; }
    std::span<Word> flat() { return data_; }
    void swap(Population& other) { data_.swap(other.data_); }

private:
    int words_;
    std::vector<Word> data_;
};

}  // namespace gaident
