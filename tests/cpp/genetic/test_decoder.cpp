#include "check.hpp"
#include "gaident/genetic/decoder.hpp"
#include "gaident/simulation/kernels/kernels.hpp"

using namespace gaident;

TEST_CASE("decoder: a lane holds what decode() gives, bit for bit, for any genome, and zeros where its structure ends") {
    Random random(41);
    for (const int bits : {2, 7, 10, 13, 16})
        for (const int most_order : {3, 7})
            for (const Code code : {Code::binary, Code::gray})
                for (const Scale scale : {Scale::linear, Scale::logarithmic}) {
                    SearchRanges ranges;
                    ranges.bits = bits;
                    ranges.p_max = ranges.q_max = most_order;
                    ranges.p_min = bits == 7 ? 1 : 0;
                    ranges.gain_scale = bits == 10 ? 1.0 : 37.0;
                    ranges.real = {-3.0, 60.0};
                    const Genome genome(ranges, code, scale);
                    const Decoder decoder(genome);
                    for (int repeat = 0; repeat < 200; ++repeat) {
                        Population all(5, genome.words());
                        random.words(all.flat().data(), all.flat().size());
                        const std::size_t chosen = random.below(5);
                        const Factors<double> f = decode(all[chosen], genome);
                        const Structure s = f.structure;
                        CHECK(decoder.structure(all[chosen]) == s);
                        Counts most = f.counts();  // or of a larger structure beside it
                        if (repeat % 2 == 0) most = Counts(Structure{7, 7});
                        most.single_pole = most.single_zero = true;
                        FactorGroup group;
                        std::size_t index[FactorGroup::width] = {};
                        const std::size_t lane = random.below(FactorGroup::width);
                        index[lane] = chosen;
                        decoder.place(all, index, lane, lane + 1, group, most);
                        CHECK(group.gain[lane] == f.gain);
                        for (int i = 0; i < most.pole_pairs; ++i) {
                            CHECK(group.pole_e1[i][lane] == (i < s.pole_pairs() ? f.pole_pair[i].e1 : 0.0));
                            CHECK(group.pole_e0[i][lane] == (i < s.pole_pairs() ? f.pole_pair[i].e0 : 0.0));
                        }
                        for (int i = 0; i < most.zero_pairs; ++i) {
                            CHECK(group.zero_e1[i][lane] == (i < s.zero_pairs() ? f.zero_pair[i].e1 : 0.0));
                            CHECK(group.zero_e0[i][lane] == (i < s.zero_pairs() ? f.zero_pair[i].e0 : 0.0));
                        }
                        CHECK(group.pole[lane] == (s.single_pole() ? f.pole : 0.0));
                        CHECK(group.zero[lane] == (s.single_zero() ? f.zero : 0.0));
                        for (int i = 0; i < most.p; ++i) CHECK(group.excess[i][lane] == (i < s.p ? 1.0 : 0.0));
                    }
                }
}
