// The default engine: one species per structure, so that no structure is lost before its parameters are any good (METHOD.md section 3).
//
// In rounds: some generations of the genetic search inside each species, then a local fit of each species' best. From small
// structures to large, a fitted structure also lends its optimum to the larger ones: a module that nearly cancels is added, at the place
// on a grid of frequencies where it helps most, and the local fit goes on from there. Structures are not compared here.
#pragma once

#include "breeder.hpp"

namespace gaident {

Trial run_species(const Experiment& experiment, const Genome& genome, const Settings& settings, Random random, int workers,
                  Progress& progress);

// Structures allowed by the ranges, by p + q, then by q.
std::vector<Structure> structures(const SearchRanges& ranges);

// Candidates for structure `to` made from the fitted `from` by adding one module of each kind, over a grid of frequencies; empty where
// `to` is not one module (or one conjugate pair of modules) larger.
std::vector<Factors<double>> grow(const Factors<double>& from, Structure to, const SearchRanges& ranges, double slowest,
                                  double fastest);

}  // namespace gaident
