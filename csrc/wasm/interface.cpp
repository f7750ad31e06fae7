#include "interface.h"

#include "../gaident/estimation/statistics.hpp"
#include "../gaident/identification/plant_search.hpp"
#include "../gaident/simulation/simulate.hpp"

#include <string>

#ifdef __EMSCRIPTEN__
#include <emscripten.h>

// Generations done, best fitness, species that compete, and of the one that leads p and q (-1: none yet).
EM_JS(void, tell_progress, (double done, double best, int species, int p, int q), {
    if (Module["progress"]) Module["progress"](done, best, species, p, q);
});
#endif

using namespace gaident;

struct gaident_session {
    std::vector<double> input, output;
    Experiment experiment;
    SearchRanges ranges;
    std::vector<Refined> fits;
};

namespace {

std::string message;
SearchRanges searched;  // of the search that is under way

// What `work` returns; -1 with a message where it throws.
template <class Work>
int guarded(const Work& work) {
    try {
        return work();
    } catch (const std::exception& wrong) {
        message = wrong.what();
    } catch (const Stopped&) {
        message = "stopped";
    }
    return -1;
}

std::span<const double> view(const double* numbers, int n) { return {numbers, static_cast<std::size_t>(n)}; }

std::vector<std::complex<double>> roots(const double* numbers, int n) {
    std::vector<std::complex<double>> all;
    for (int i = 0; i < n; ++i) all.emplace_back(numbers[2 * i], numbers[2 * i + 1]);
    return all;
}

const Refined& fit_of(const gaident_session& s, int fit) {
    if (fit < 0 || static_cast<std::size_t>(fit) >= s.fits.size())
        throw std::invalid_argument("fit: the session has no such fit");
    return s.fits[static_cast<std::size_t>(fit)];
}

int added(gaident_session& s, Refined fit) {
    s.fits.push_back(std::move(fit));
    return static_cast<int>(s.fits.size()) - 1;
}

Refined gone_on(const gaident_session& s, const Refined& from, std::span<const double> phi, int iterations, double tolerance) {
    if (phi.size() >= chunk_samples) throw std::invalid_argument("phi: at most 511 coefficients");
    RefineOptions options;
    options.ranges = s.ranges;
    options.whitening.assign(phi.begin(), phi.end());
    options.tolerance = tolerance;
    return Refiner(s.experiment, options).go_on(from, iterations);
}

void tell([[maybe_unused]] const Progress& progress) {
#ifdef __EMSCRIPTEN__
    const Structure leading = leading_structure(searched, progress);
    tell_progress(static_cast<double>(progress.done.load()), progress.best, static_cast<int>(progress.species.load()), leading.p,
                  leading.q);
#endif
}

PlantSettings settings_of(const double* v) {
    PlantSettings s;
    s.population = static_cast<int>(v[0]);
    s.tournament = static_cast<int>(v[1]);
    s.crossover = v[2];
    s.mutation = v[3];
    s.generations = static_cast<int>(v[4]);
    s.round = static_cast<int>(v[5]);
    s.quiet_rounds = static_cast<int>(v[6]);
    s.code = v[7] != 0.0 ? Code::gray : Code::binary;
    s.roots = v[8] != 0.0 ? Scale::logarithmic : Scale::linear;
    s.weights = {v[9], v[10]};
    s.species = true;
    return s;
}

}  // namespace

const char* gaident_message(void) { return message.c_str(); }
void gaident_close(gaident_session* session) { delete session; }

gaident_session* gaident_open(const double* input, const double* output, int n, double sample_time, int moving, double velocity0,
                              enum gaident_loop loop, const double controller[4]) {
    auto made = std::make_unique<gaident_session>();
    const int done = guarded([&] {
        if (n < 1) throw std::invalid_argument("n: a record needs samples");
        made->input.assign(input, input + n);
        made->output.assign(output, output + n);
        Experiment& e = made->experiment;
        e.loop.kind = loop == gaident_open_loop      ? LoopKind::open
                      : loop == gaident_sampled_loop ? LoopKind::sampled
                                                     : LoopKind::continuous;
        if (loop != gaident_open_loop) e.loop.controller = {controller[0], controller[1], controller[2], controller[3]};
        e.records.push_back({made->input, made->output, sample_time, moving != 0 ? Start::free : Start::rest, velocity0});
        e.check();
        return 0;
    });
    return done < 0 ? nullptr : made.release();
}

int gaident_set_ranges(gaident_session* session, const double v[gaident_range_numbers]) {
    return guarded([&] {
        const auto whole = [&](int i) { return static_cast<int>(v[i]); };
        session->ranges = {{v[0], v[1]}, {v[2], v[3]}, {v[4], v[5]}, whole(6), whole(7), whole(8), whole(9), whole(10), v[11]};
        return 0;
    });
}

int gaident_search(gaident_session* session, const double settings[gaident_setting_numbers], uint32_t seed) {
    return guarded([&] {
        Progress progress;
        progress.noted = tell;
        searched = session->ranges;
        std::vector<PlantTrial> found =
            search_plant(session->experiment, session->ranges, settings_of(settings), 1, seed, 1, progress);
        for (Refined& fit : found.front().species) added(*session, std::move(fit));
        return static_cast<int>(found.front().species.size());
    });
}

int gaident_fit(gaident_session* session, double gain, const double* poles, int n_poles, const double* zeros, int n_zeros,
                const double* starts, int states, int iterations, double tolerance) {
    return guarded([&] {
        Refined from;
        from.factors = factors_from_roots(gain, roots(poles, n_poles), roots(zeros, n_zeros));
        from.starts.assign(starts, starts + states);
        if (from.starts.empty())
            from.starts = Unknowns(session->experiment, from.factors.structure).steady_starts(session->experiment, from.factors);
        return added(*session, gone_on(*session, from, {}, iterations, tolerance));
    });
}

int gaident_go_on(gaident_session* session, int fit, const double* phi, int n_phi, int iterations, double tolerance) {
    return guarded(
        [&] { return added(*session, gone_on(*session, fit_of(*session, fit), view(phi, n_phi), iterations, tolerance)); });
}

int gaident_read_fit(gaident_session* session, int fit, double out[gaident_fit_numbers]) {
    return guarded([&] {
        const Refined& r = fit_of(*session, fit);
        const Structure s = r.factors.structure;
        std::complex<double> poles[max_plant_order], zeros[max_plant_order];
        roots_of(r.factors, poles, zeros);
        int n = 0;
        const auto put = [&](double x) { out[n++] = x; };
        for (const double x : {double(s.p), double(s.q), r.factors.gain, r.cost, double(r.starts.size())}) put(x);
        for (int i = 0; i < s.poles(); ++i) put(poles[i].real()), put(poles[i].imag());
        for (int i = 0; i < s.q; ++i) put(zeros[i].real()), put(zeros[i].imag());
        for (const double x : r.starts) put(x);
        for (const bool at : r.at_bound) put(at ? 1.0 : 0.0);
        return n;
    });
}

int gaident_residual_sums(gaident_session* session, int fit, int lags, double* out) {
    return guarded([&] {
        const Refined& r = fit_of(*session, fit);
        const ResidualSums sums = residual_sums(session->experiment, r.factors, r.starts, static_cast<std::size_t>(lags));
        std::copy(sums.products.begin(), sums.products.end(), out);
        out[sums.products.size()] = sums.largest_output;
        return static_cast<int>(sums.products.size()) + 1;
    });
}

int gaident_fit_sums(gaident_session* session, int fit, const double* phi, int n_phi, const int* lags, int n_lags,
                     double threshold, double* out, int room) {
    return guarded([&] {
        const Refined& r = fit_of(*session, fit);
        const FitSums sums = fit_sums(session->experiment, r.factors, r.starts, view(phi, n_phi),
                                      {lags, static_cast<std::size_t>(n_lags)}, threshold);
        if (sums.plain.size() + sums.coloured.size() + sums.white.size() > static_cast<std::size_t>(room))
            throw std::invalid_argument("room: too small for the sums");
        for (const auto* all : {&sums.plain, &sums.coloured, &sums.white}) out = std::copy(all->begin(), all->end(), out);
        return static_cast<int>(sums.unknowns);
    });
}

int gaident_simulate(gaident_session* session, int fit, double* velocity, double* torque) {
    return guarded([&] {
        const Refined& r = fit_of(*session, fit);
        const std::size_t n = session->input.size();
        simulate<double>(r.factors, session->input, session->experiment.records.front().sample_time, session->experiment.loop,
                         r.starts.empty() ? nullptr : r.starts.data(), {velocity, n}, {torque, n});
        return 0;
    });
}
