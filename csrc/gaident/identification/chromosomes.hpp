// A population of chromosomes as the candidates of a batch (candidates.hpp).
#pragma once

#include "../genetic/decoder.hpp"
#include "../simulation/candidates.hpp"

namespace gaident {

class Chromosomes final : public Candidates {
public:
    Chromosomes(const Population& all, const Decoder& decoder) : all_(all), decoder_(decoder) {}

    std::size_t size() const override { return all_.size(); }
    void structures(Structure* all) const override {
        for (std::size_t i = 0; i < all_.size(); ++i) all[i] = decoder_.structure(all_[i]);
    }
    Factors<double> factors(std::size_t i) const override { return decode(all_[i], decoder_.genome()); }
    void place(const std::size_t* index, const Structure* s, std::size_t count, FactorGroup& group) const override {
        by_structure(s, count,
                     [&](std::size_t first, std::size_t last) { decoder_.place(all_, index, first, last, group, group.counts); });
    }

private:
    const Population& all_;
    const Decoder& decoder_;
};

}  // namespace gaident
