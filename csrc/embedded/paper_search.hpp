// The paper's search as this program is compiled for it: arithmetic by GAIDENT_ARITHMETIC, sizes and ranges here, its constants
// in flash.
#pragma once

#include "../gaident/numeric/c30.hpp"
#include "../gaident/target/fixed_scaling.hpp"
#include "../gaident/target/static_search.hpp"
#include "genes.hpp"  // made by make_tables.cpp

namespace gaident {

namespace in_drive {
using Double = Plain<double>;
using Float = Plain<float>;
using C30 = Plain<gaident::C30Word, gaident::C30>;
using Fixed = FixedPoint<2>;
}  // namespace in_drive

using InDrive = in_drive::GAIDENT_ARITHMETIC;
using Number = InDrive::Number;

inline constexpr int population = 50, record_samples = 250;
using PaperSearch = StaticSearch<InDrive, population, record_samples>;

inline constexpr Genome paper_genome(SearchRanges{}, Code::binary, Scale::linear);

template <int n>
struct Numbers {
    Number at[n];
    explicit constexpr Numbers(const double (&values)[n]) : at{} {
        for (int i = 0; i < n; ++i) at[i] = static_cast<Number>(values[i]);
    }
};

inline constexpr Numbers<1024> gains(gain_values), reals(real_values), imaginaries(imaginary_values);

// Table II on the paper's genome; the loop is the caller's to set.
inline StaticSetup<InDrive> paper_setup() {
    StaticSetup<InDrive> s;
    s.genome = &paper_genome;
    s.values.gain = gains.at;
    s.values.real = reals.at;
    s.values.imaginary = imaginaries.at;
    for (Number& unit : s.values.unit) unit = static_cast<Number>(1.0);
    return s;
}

}  // namespace gaident
