#include "../gaident/genetic/decode.hpp"
#include "../gaident/runtime/parallel.hpp"
#include "../gaident/estimation/statistics.hpp"
#include "bindings.hpp"

using namespace gaident;

namespace {

// The records and responses of an identification, with the arrays they borrow.
struct PyExperiment {
    std::vector<PyRecord> arrays;
    std::vector<std::shared_ptr<const Response>> responses;
    Experiment experiment;
    std::atomic<bool> stop{false};

    PyExperiment(std::vector<PyRecord> records, const Loop& loop, const std::string& kernels,
                 std::vector<std::shared_ptr<const Response>> measured)
        : arrays(std::move(records)), responses(std::move(measured)) {
        for (PyRecord& r : arrays) {
            r.close(loop);
            experiment.records.push_back(r.record);
        }
        experiment.loop = loop;
        for (const auto& r : responses) experiment.responses.push_back(r.get());
        if (!kernels.empty()) {
            experiment.kernels = kernels_named(kernels.c_str());
            if (experiment.kernels == nullptr)
                throw std::invalid_argument("kernels: '" + kernels + "' is not available on this machine");
        }
        experiment.stop = &stop;
        experiment.check();
    }
};

struct PyRefined {
    Refined r;
};

void run_work(PyExperiment& e, std::size_t times, const std::function<void()>& work) {
    e.stop = false;
    run_interruptibly(e.stop, times * e.experiment.samples(), work);
}

RefineOptions options_of(const std::optional<SearchRanges>& ranges, const std::vector<double>& whitening,
                         double tolerance = 1e-9) {
    RefineOptions o;
    o.tolerance = tolerance;
    if (ranges) o.ranges = *ranges;
    o.bounded = ranges.has_value();
    o.whitening = whitening;
    if (whitening.size() >= chunk_samples) throw std::invalid_argument("whitening: at most 511 coefficients");
    return o;
}

// `report`: a function of generations done, best fitness, number of species, (p, q) of the one that leads.
std::vector<PlantTrial> search_records(PyExperiment& e, const SearchRanges& ranges, const PlantSettings& settings, int trials,
                                       std::uint64_t seed, int workers, const std::optional<py::function>& report) {
    std::vector<PlantTrial> result;
    Progress progress;
    e.stop = false;
    run_interruptibly(
        e.stop, [&] { result = search_plant(e.experiment, ranges, settings, trials, seed, workers, progress); },
        [&] {
            const Structure leading = leading_structure(ranges, progress);
            if (report)
                asked(*report, py::make_tuple(progress.done.load(), progress.best.load(), progress.species.load(),
                                              std::pair(leading.p, leading.q)));
        });
    return result;
}

std::vector<PyRefined> go_on(PyExperiment& e, const std::vector<PyRefined>& fits, const std::optional<SearchRanges>& ranges,
                             const std::vector<double>& whitening, int max_iterations, double tolerance, int workers) {
    std::vector<PyRefined> result(fits.size());
    Workers all(workers);
    Experiment shared = e.experiment;
    shared.workers = &all;
    const Refiner refiner(shared, options_of(ranges, whitening, tolerance));
    run_work(e, fits.size() * static_cast<std::size_t>(std::max(1, max_iterations)),
             [&] { all.share(fits.size(), [&](std::size_t i) { result[i].r = refiner.go_on(fits[i].r, max_iterations); }); });
    return result;
}

// Refines several starting models at once: one list entry each, in the order given.
std::vector<PyRefined> refine(PyExperiment& e,
                              const std::vector<std::tuple<double, ComplexArray, ComplexArray, RealArray>>& models,
                              const std::optional<SearchRanges>& ranges, const std::vector<double>& whitening, int max_iterations,
                              int workers, double tolerance) {
    std::vector<PyRefined> fits;
    for (const auto& [gain, poles, zeros, start] : models) {
        PyRefined f;
        f.r.factors = make_factors(gain, poles, zeros);
        f.r.starts.assign(start.data(), start.data() + start.size());
        if (f.r.starts.empty())
            f.r.starts = Unknowns(e.experiment, f.r.factors.structure).steady_starts(e.experiment, f.r.factors);
        fits.push_back(std::move(f));
    }
    return go_on(e, fits, ranges, whitening, max_iterations, tolerance, workers);
}

// (sums of e(n) e(n+k) for k = 0..lags, largest |wm|)
std::pair<RealArray, double> residual_sums_of(PyExperiment& e, const PyRefined& fit, std::size_t lags) {
    ResidualSums sums;
    run_work(e, 1, [&] { sums = residual_sums(e.experiment, fit.r.factors, fit.r.starts, lags); });
    return {to_array(sums.products), sums.largest_output};
}

// (J'J, J'SJ, X'X), see statistics.hpp
std::tuple<RealArray, RealArray, RealArray> fit_sums_of(PyExperiment& e, const PyRefined& fit, const std::vector<double>& phi,
                                                        const std::vector<int>& lags, double threshold) {
    if (phi.size() >= chunk_samples) throw std::invalid_argument("phi: at most 511 coefficients");
    FitSums sums;
    run_work(e, 2, [&] { sums = fit_sums(e.experiment, fit.r.factors, fit.r.starts, phi, lags, threshold); });
    const auto square = [](const std::vector<double>& v) {
        const auto n = static_cast<py::ssize_t>(std::lround(std::sqrt(static_cast<double>(v.size()))));
        RealArray a({n, n});
        std::copy(v.begin(), v.end(), a.mutable_data());
        return a;
    };
    return {square(sums.plain), square(sums.coloured), square(sums.white)};
}

py::tuple sensitivities(PyExperiment& e, double gain, const ComplexArray& poles, const ComplexArray& zeros,
                        const std::vector<double>& starts, const std::vector<double>& whitening) {
    const Factors<double> g = make_factors(gain, poles, zeros);
    std::vector<double> error, columns;
    const Refiner refiner(e.experiment, options_of(std::nullopt, whitening));
    run_work(e, 2, [&] { refiner.sensitivities(g, starts, error, columns); });
    RealArray J({static_cast<py::ssize_t>(refiner.parameters(g.structure)), static_cast<py::ssize_t>(error.size())});
    std::copy(columns.begin(), columns.end(), J.mutable_data());
    std::vector<double> factors;
    const auto pair = [&](Pair<double> f) { factors.insert(factors.end(), {f.e1, f.e0}); };
    for (int i = 0; i < g.structure.pole_pairs(); ++i) pair(g.pole_pair[i]);
    if (g.structure.single_pole()) factors.push_back(g.pole);
    for (int i = 0; i < g.structure.zero_pairs(); ++i) pair(g.zero_pair[i]);
    if (g.structure.single_zero()) factors.push_back(g.zero);
    return py::make_tuple(to_array(error), J, to_array(factors));
}

ComplexArray plant_at(const Response& r, double gain, const ComplexArray& poles, const ComplexArray& zeros) {
    std::vector<double> real(r.size()), imaginary(r.size());
    r.plant(make_factors(gain, poles, zeros), 0, real, imaginary);
    ComplexArray found(static_cast<py::ssize_t>(r.size()));
    for (std::size_t k = 0; k < r.size(); ++k) found.mutable_data()[k] = {real[k], imaginary[k]};
    return found;
}

std::tuple<double, ComplexArray, ComplexArray> decode_bits(const std::vector<Word>& words, const SearchRanges& ranges, bool gray,
                                                           bool logarithmic) {
    const Genome genome(ranges, gray ? Code::gray : Code::binary, logarithmic ? Scale::logarithmic : Scale::linear);
    if (static_cast<int>(words.size()) != genome.words())
        throw std::invalid_argument("words: wrong number of words for this genome");
    const Factors<double> f = decode(words.data(), genome);
    return {f.gain, poles_of(f), zeros_of(f)};
}

}  // namespace

void bind_identify(py::module_& m) {
    py::class_<SearchRanges>(m, "SearchRanges")
        .def(py::init([](std::pair<double, double> gain, std::pair<double, double> real, std::pair<double, double> imaginary,
                         std::pair<int, int> p, std::pair<int, int> q, int bits, double gain_scale) {
                 return SearchRanges{{gain.first, gain.second},
                                     {real.first, real.second},
                                     {imaginary.first, imaginary.second},
                                     p.first,
                                     p.second,
                                     q.first,
                                     q.second,
                                     bits,
                                     gain_scale};
             }),
             py::arg("gain"), py::arg("real"), py::arg("imaginary"), py::arg("p"), py::arg("q"), py::arg("bits"),
             py::arg("gain_scale") = 1.0);

    py::class_<PlantSettings>(m, "EngineSettings")
        .def(py::init([](int population, int tournament, double crossover, double mutation, int generations, int elites,
                         bool gray, bool logarithmic, double error_weight, double order_weight, bool species, int round,
                         int quiet_rounds, bool in_float, const std::string& mirror) {
                 PlantSettings s;
                 s.population = population;
                 s.tournament = tournament;
                 s.crossover = crossover;
                 s.mutation = mutation;
                 s.generations = generations;
                 s.elites = elites;
                 s.code = gray ? Code::gray : Code::binary;
                 s.roots = logarithmic ? Scale::logarithmic : Scale::linear;
                 s.weights = {error_weight, order_weight};
                 s.species = species;
                 s.round = round;
                 s.quiet_rounds = quiet_rounds;
                 s.in_float = in_float;
                 s.mirror = mirror;
                 s.check();
                 return s;
             }),
             py::arg("population"), py::arg("tournament"), py::arg("crossover"), py::arg("mutation"), py::arg("generations"),
             py::arg("elites"), py::arg("gray"), py::arg("logarithmic"), py::arg("error_weight"), py::arg("order_weight"),
             py::arg("species"), py::arg("round"), py::arg("quiet_rounds"), py::arg("in_float"), py::arg("mirror") = "");

    py::class_<Response, std::shared_ptr<Response>>(m, "Response")
        .def(py::init([](const ComplexArray& at, const ComplexArray& value, const RealArray& weight, double sample_time,
                         std::pair<double, double> band, double noise) {
                 const auto all = [](const ComplexArray& a) {
                     return std::span<const std::complex<double>>(a.data(), static_cast<std::size_t>(a.size()));
                 };
                 return std::make_shared<Response>(all(at), all(value), view(weight), sample_time, band.first, band.second,
                                                   noise);
             }),
             py::kw_only(), py::arg("at"), py::arg("value"), py::arg("weight"), py::arg("sample_time"), py::arg("band"),
             py::arg("noise"))
        .def("plant", &plant_at, py::arg("gain"), py::arg("poles"), py::arg("zeros"));

    py::class_<PyRefined>(m, "Refined")
        .def_property_readonly("gain", [](const PyRefined& f) { return f.r.factors.gain; })
        .def_property_readonly("poles", [](const PyRefined& f) { return poles_of(f.r.factors); })
        .def_property_readonly("zeros", [](const PyRefined& f) { return zeros_of(f.r.factors); })
        .def_property_readonly("p", [](const PyRefined& f) { return f.r.factors.structure.p; })
        .def_property_readonly("q", [](const PyRefined& f) { return f.r.factors.structure.q; })
        .def_property_readonly("starts", [](const PyRefined& f) { return to_array(f.r.starts); })
        .def_property_readonly("cost", [](const PyRefined& f) { return f.r.cost; })
        .def_property_readonly("iterations", [](const PyRefined& f) { return f.r.iterations; })
        .def_property_readonly("converged", [](const PyRefined& f) { return f.r.converged; })
        .def_property_readonly("at_bound", [](const PyRefined& f) { return f.r.at_bound; });

    py::class_<PlantTrial>(m, "Trial")
        .def_property_readonly("history", [](const PlantTrial& t) { return to_array(t.history); })
        .def_property_readonly("best_fitness", [](const PlantTrial& t) { return t.best_fitness; })
        .def_property_readonly("best_generation", [](const PlantTrial& t) { return t.best_generation; })
        .def_property_readonly("best", [](const PlantTrial& t) { return t.best; })
        .def_property_readonly("evaluations", [](const PlantTrial& t) { return t.evaluations; })
        .def_property_readonly("overflows", [](const PlantTrial& t) { return t.overflows; })
        .def_property_readonly("species", [](const PlantTrial& t) {
            std::vector<PyRefined> all;
            for (const Refined& r : t.species) all.push_back({r});
            return all;
        });

    py::class_<PyExperiment>(m, "Experiment")
        .def(py::init<std::vector<PyRecord>, const Loop&, const std::string&, std::vector<std::shared_ptr<const Response>>>(),
             py::arg("records"), py::arg("loop"), py::arg("kernels") = "",
             py::arg("responses") = std::vector<std::shared_ptr<const Response>>{})
        .def_property_readonly("kernels", [](const PyExperiment& e) { return e.experiment.kernels->name; })
        .def_property_readonly("fused", [](const PyExperiment& e) { return e.experiment.kernels->fused; })
        .def("search", &search_records, py::arg("ranges"), py::arg("settings"), py::arg("trials"), py::arg("seed"),
             py::arg("workers"), py::arg("progress") = py::none())
        .def("refine", &refine, py::arg("models"), py::arg("ranges"), py::arg("whitening"), py::arg("max_iterations"),
             py::arg("workers"), py::arg("tolerance") = 1e-9)
        .def("go_on", &go_on, py::arg("fits"), py::arg("ranges"), py::arg("whitening"), py::arg("max_iterations"),
             py::arg("tolerance"), py::arg("workers"))
        .def("residual_sums", &residual_sums_of, py::arg("fit"), py::arg("lags"))
        .def("fit_sums", &fit_sums_of, py::arg("fit"), py::arg("phi"), py::arg("lags"), py::arg("threshold"))
        .def("sensitivities", &sensitivities, py::arg("gain"), py::arg("poles"), py::arg("zeros"), py::arg("starts"),
             py::arg("whitening"));

    m.def("decode", &decode_bits, py::arg("words"), py::arg("ranges"), py::arg("gray"), py::arg("logarithmic"));
}
