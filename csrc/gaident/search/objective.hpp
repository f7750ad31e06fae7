// What a search is made for: an objective gives every chromosome its cost.
// The engine knows of the problem what stands here, and no more.
//
// The functions of an objective are called by several threads at once; an evaluator belongs to one thread at a time.
#pragma once

#include "../genetic/layout.hpp"
#include "../genetic/population.hpp"

#include <limits>
#include <memory>

namespace gaident {

// The cost of a candidate that has none, because it diverges: the worst, and never NaN, so it cannot spoil a search.
inline constexpr double worst_cost = std::numeric_limits<double>::max();

// The costs of whole populations, with the memory that takes.
class Evaluator {
public:
    virtual ~Evaluator() = default;
    // costs[i]: of chromosome i, from 0 to worst_cost; smaller is better. Allocates nothing.
    virtual void evaluate(const Population& all, std::span<double> costs) = 0;
    // Chromosomes so far whose evaluation left the range of its arithmetic, where the evaluator has such a range.
    virtual std::size_t overflows() const { return 0; }
};

class Objective {
public:
    virtual ~Objective() = default;
    virtual Layout layout() const = 0;
    // For populations of up to `capacity` chromosomes.
    virtual std::unique_ptr<Evaluator> evaluator(std::size_t capacity) const = 0;
};

// Of candidates that have different parameters, those with the same ones are a species.
struct Species {
    int level = 0;      // how large: the local search of a species may start from the optimum of one of a lower level
    bool asked = true;  // false: searched only because its optimum is a start for larger ones, and not reported
};

// An objective with several species, and with a local search in each of them.
// `Fit` is a local optimum, or a point on the way to one: it can be made without arguments and has the member `cost`, then
// worst_cost.
// Species are numbered from 0.
template <class Fit>
class SpeciesObjective : public Objective {
public:
    // In ascending order of their levels; at least one is asked for.
    virtual std::span<const Species> species() const = 0;
    // Writes the first layout().species_bits bits.
    virtual void set_species(Word* chromosome, std::size_t species) const = 0;
    // Whether an optimum of species `small` is a start for species `large`.
    virtual bool leads_to(std::size_t small, std::size_t large) const = 0;

    // Starts of a local search: a chromosome; at most `count` in species `to`, made from an optimum of a species that leads to
    // it; the best in species `to`, to which `from` reduces, its cost worst_cost where there is none.
    virtual Fit start(const Word* chromosome) const = 0;
    virtual std::vector<Fit> enlarged(const Fit& from, std::size_t to, std::size_t count) const = 0;
    virtual Fit reduced(const Fit& from, std::size_t to) const = 0;
    // Up to so many iterations of the local search further.
    virtual Fit improved(const Fit& from, int iterations) const = 0;

    // The cost that a perfect candidate is expected to have; nobody searches far below it.
    virtual double least_expected() const { return 0.0; }
    // Whether one evaluation takes so long that it is worth handing to another thread.
    virtual bool is_long() const { return false; }
};

}  // namespace gaident
