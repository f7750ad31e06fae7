// The velocity that a drive makes of an encoder's angle: its difference over a sample T of the controller, the mean velocity there,
//
//     w_m(n) = (theta(n) - theta(n-1))/T = 1/T int w dt = 1/m sum_k ((w(k) + w(k+1))/2 + bend(k)),   m substeps
//
// with bend by how much the mean over a substep is above that of its ends (mechanism.hpp, and what filters make of it).
// Where the sensor tells its output at the ends alone, it is taken by Simpson's rule over pairs of substeps,
//
//     w_m(n) = 1/m sum_k (w(2k) + 4 w(2k+1) + w(2k+2))/3 + O(h^4),   h = T/m, m even
//
// A delay of T/2 has the same phase but not the size sin(x)/x, x = omega T/2: at 500 Hz and 125 us that is 0.6 %, a hundred times the
// steps of a fine encoder.
#pragma once

namespace gaident {

template <class R>
class SampleMean {
public:
    // What is seen at the controller's sample, where the velocity is w; before the first one there is nothing to take a mean of.
    R at_sample(R w, int substeps, bool in_pairs) {
        const R end = in_pairs ? w : R(w * R(0.5));
        const R seen = begun_ ? R((sum_ + end) * R(1.0 / (in_pairs ? 3.0 * substeps : substeps))) : w;
        sum_ = end;
        begun_ = true;
        return seen;
    }
    // The bend of a substep; and the velocity behind it, but for the last of a sample.
    void over_substep(R bend) { sum_ = sum_ + bend; }
    void behind_substep(R w) { sum_ = sum_ + w; }
    // The same of the substep j where they go in pairs.
    void behind_one_of_pair(int j, R w) { sum_ = fma(w, R(j % 2 == 0 ? 4.0 : 2.0), sum_); }

private:
    R sum_ = R(0.0);
    bool begun_ = false;
};

}  // namespace gaident
