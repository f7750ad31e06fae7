// Points of one structure run over the records, chunk by chunk, and then over the responses: what a local fit and the statistics of a
// fit are made of.
//
//     e(n) = w(n) - wm(n; x),     de/dx_i by forward differences, one point per lane
//
// Nothing as long as a record is kept.
#pragma once

#include "../simulation/batch.hpp"

#include <functional>

namespace gaident {

// The unknowns of a fit: the model's parameters (parameters.hpp), then the start states of each record with Start::free.
struct Unknowns {
    Unknowns(const Experiment& experiment, Structure s);

    Structure structure;
    std::size_t model;                // parameters of the model
    std::size_t states;               // of one free record
    std::size_t count;                // of all
    std::vector<std::size_t> starts;  // per record: where its start states stand; `none` at rest
    static constexpr std::size_t none = ~std::size_t{0};

    // What record r depends on, in ascending order.
    std::vector<std::size_t> of_record(std::size_t r) const;
    // Steady motion at each free record's first velocity.
    std::vector<double> steady_starts(const Experiment& experiment, const Factors<double>& g) const;
};

// Error and derivatives over one chunk of one record, or of one response: its weighted numbers, which are numbered behind the records.
struct Chunk {
    static constexpr std::size_t width = double_lanes, per_group = width - 1;

    std::size_t record, first, n;
    std::size_t size;                              // of the whole record
    bool response;                                 // its errors are independent of each other
    std::span<const std::size_t> unknowns;         // of this record
    std::span<const std::vector<double>> columns;  // per group of lanes; see rows()
    std::size_t history;

    std::size_t groups() const { return columns.size(); }
    bool is_last() const { return first + n == size; }
    // [sample][lane]: lane 0 is e in every group, lane l > 0 of group g is de/dx of unknowns[7 g + l - 1], what is left means
    // nothing.
    // `history` rows of earlier samples stand in front, zeros before the record.
    const double* rows(std::size_t g) const { return columns[g].data() + history * width; }
};

class Sweep {
public:
    explicit Sweep(const Experiment& experiment);

    using OnChunk = std::function<void(const Chunk&)>;
    void linearise(std::span<const double> x, const Unknowns& unknowns, std::size_t history, const OnChunk& on_chunk);

    // The outputs at one point, of the records.
    using OnOutputs = std::function<void(std::size_t record, std::size_t first, std::span<const double> y)>;
    void outputs(std::span<const double> x, const Unknowns& unknowns, const OnOutputs& on_outputs);

    // sums[i] = sum of squares of e at points[i], or of e filtered by 1 - sum phi_i z^-i where phi is not empty.
    // Responses are not filtered. At most double_lanes points.
    void errors(std::span<const double* const> points, const Unknowns& unknowns, std::span<const double> phi, double* sums);

    // e filtered: rows that lack part of their past are zero.
    static void whiten(const Experiment& experiment, std::span<const double> phi, std::size_t first, std::size_t n,
                       const double* rows, double* out);

private:
    // Calls use(first, n) for each chunk of the record.
    template <class Use>
    void each_chunk(const Record& record, const Use& use) const {
        for (std::size_t first = 0; first < record.size(); first += chunk_samples) {
            use(first, std::min(chunk_samples, record.size() - first));
            experiment_.stop_if_asked();
        }
    }
    // The models of the points, and what scales their derivatives: x moved in unknowns 7 g, 7 g + 1, ... of a group.
    std::size_t moved(std::span<const double> x, const Unknowns& unknowns, std::span<const std::size_t> own, std::size_t group,
                      const double** points, double* scale);
    void load(std::size_t record, std::span<const double* const> points, const Unknowns& unknowns, DoubleGroup& group) const;

    const Experiment& experiment_;
    double slowest_;  // 1 / duration of the longest record: the scale below which a root is as good as zero
    std::vector<DoubleGroup> bank_;
    std::vector<std::vector<double>> columns_;
    std::vector<double> coloured_, white_, moved_;
};

}  // namespace gaident
