// The record that tests of the search run on.
#pragma once

#include "gaident/simulation/batch.hpp"
#include "gaident/reference/drives.hpp"

namespace gaident {

// The paper's two-mass record, or one like it.
struct Bench {
    reference::Drive drive;
    reference::Measurement measured;
    Experiment experiment;

    explicit Bench(reference::Drive d, double noise = 0.3, std::uint64_t seed = 17)
        : drive(std::move(d)), measured(drive, noise, seed) {
        experiment.records.push_back(measured.record());
        experiment.loop = drive.loop;
    }
    Bench(const Bench&) = delete;
};

// A difference equation from rest, run in R.
template <class R>
std::vector<double> outputs(const Delta<double>& h, const std::vector<double>& input) {
    R a[max_loop_order], b[max_loop_order + 1], x[max_loop_order] = {};
    for (int i = 0; i < h.order; ++i) a[i] = static_cast<R>(h.a[i]);
    for (int i = 0; i <= h.order; ++i) b[i] = static_cast<R>(h.b[i]);
    std::vector<double> y;
    for (const double u : input) y.push_back(static_cast<double>(recurrence_step<R, -1>(h.order, a, b, x, static_cast<R>(u))));
    return y;
}

inline reference::Drive two_mass(LoopKind kind = LoopKind::continuous, std::size_t samples = 250) {
    reference::Drive d = reference::paper_drive(true);
    d.loop.kind = kind;
    d.input.assign(samples, kind == LoopKind::open ? 0.2 : 43.6);
    return d;
}

}  // namespace gaident
