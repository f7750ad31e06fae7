// The record that tests of the search run on.
#pragma once

#include "gaident/batch.hpp"
#include "gaident/reference/drives.hpp"

namespace gaident {

// The paper's two-mass record, or one like it.
struct Bench {
    reference::Drive drive;
    reference::Measurement measured;
    Experiment experiment;

    explicit Bench(reference::Drive d, double noise = 0.3) : drive(std::move(d)), measured(drive, noise, 17) {
        experiment.records.push_back(measured.record());
        experiment.loop = drive.loop;
    }
    Bench(const Bench&) = delete;
};

inline reference::Drive two_mass(LoopKind kind = LoopKind::continuous, std::size_t samples = 250) {
    reference::Drive d = reference::paper_drive(true);
    d.loop.kind = kind;
    d.input.assign(samples, kind == LoopKind::open ? 0.2 : 43.6);
    return d;
}

}  // namespace gaident
