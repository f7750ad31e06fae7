// Drives for the tests: random ones of every kind, and the paper's.
#pragma once

#include "../simulation/record.hpp"
#include "../plant/roots.hpp"
#include "cascade.hpp"

namespace gaident::reference {

// The fast path's description of the same plant.
inline Factors<double> factors_of(const Plant& g) {
    std::vector<Complex> poles, zeros;
    for (const Complex a : g.A1) poles.push_back(-a);
    for (const Complex a : g.A2) poles.push_back(-a);
    for (const Complex b : g.B2) zeros.push_back(-b);
    return factors_from_roots(g.K, poles, zeros);
}

// A plant, the loop around it, and what it is told to do.
struct Drive {
    Plant plant;
    Loop loop;
    double sample_time = 0.0;
    std::vector<double> input;

    template <class R>
    Response<R> respond() const {
        return run(factor_modules<R>(plant), input, sample_time, loop);
    }
    Factors<double> factors() const { return factors_of(plant); }
};

// max |y - x| / max |x|; infinite where y is not finite.
template <class Y, class X>
double deviation(const std::vector<Y>& y, const std::vector<X>& x) {
    double difference = 0.0, size = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double d = std::abs(static_cast<double>(static_cast<X>(y[i]) - x[i]));
        if (!(d < std::numeric_limits<double>::infinity())) return std::numeric_limits<double>::infinity();
        difference = std::max(difference, d);
        size = std::max(size, std::abs(static_cast<double>(x[i])));
    }
    return size > 0.0 ? difference / size : difference;
}

inline double normal(Random& random) {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += random.uniform();
    return sum;
}

inline double log_uniform(Random& random, double lo, double hi) { return lo * std::pow(hi / lo, random.uniform()); }
inline double uniform(Random& random, double lo, double hi) { return lo + (hi - lo) * random.uniform(); }

// A step, white noise, a staircase or a random walk, of some 40 rad/s.
inline std::vector<double> random_signal(Random& random, std::size_t samples) {
    const std::uint32_t kind = random.below(4);
    std::vector<double> r(samples, 43.6);
    double level = 0.0;
    for (std::size_t i = 0; i < samples && kind != 0; ++i) {
        if (kind == 1) r[i] = 20.0 * normal(random);
        if (kind == 2 && i % 25 == 0) level = 30.0 * normal(random);
        if (kind == 3) level += 3.0 * normal(random);
        if (kind != 1) r[i] = level;
    }
    return r;
}

// ordinary: roots from 2 rad/s to 0.3 of the Nyquist frequency; slow: all within 2 % of one slow root, some of them
// exactly on it; fast: up to 0.98 of the Nyquist frequency; unstable: poles in the right half plane, zeros too.
enum class Family { ordinary, slow, fast, unstable };
inline constexpr Family families[] = {Family::ordinary, Family::slow, Family::fast, Family::unstable};

inline Plant random_plant(Random& random, std::size_t p, std::size_t q, Family family, double sample_time, std::size_t samples) {
    const double nyquist = 3.141592653589793 / sample_time, base = log_uniform(random, 0.2, 5.0);
    double lo = 2.0, hi = 0.3 * nyquist;
    if (family == Family::slow) {
        lo = base;
        hi = random.below(3) == 0 ? base : 1.02 * base;
    } else if (family == Family::fast) {
        lo = 0.1 * nyquist;
        hi = 0.98 * nyquist;
    }
    const double duration = static_cast<double>(samples) * sample_time;
    const bool zeros_right = random.below(2) == 0;
    const auto real = [&](double x, bool pole) {
        if (family != Family::unstable) return x;
        return pole ? -std::min(x, uniform(random, 0.1, 3.0) / duration) : (zeros_right ? -x : x);
    };
    const auto single = [&](Complex& a, bool pole) { a = real(log_uniform(random, lo, hi), pole); };
    const auto pair = [&](Complex& a, Complex& b, bool pole) {
        if (random.uniform() < 0.6) {
            const double size = log_uniform(random, lo, hi), damping = log_uniform(random, 0.01, 1.0);
            a = Complex(real(size * damping, pole), size * std::sqrt(1.0 - damping * damping) + 1e-9 * size);
            b = std::conj(a);
        } else {
            single(a, pole);
            single(b, pole);
        }
    };
    Plant g;
    g.A1.resize(p);
    g.A2.resize(q);
    g.B2.resize(q);
    for (std::size_t i = 0; i + 1 < p; i += 2) pair(g.A1[i], g.A1[i + 1], true);
    for (std::size_t j = 0; j + 1 < q; j += 2) pair(g.A2[j], g.A2[j + 1], true);
    for (std::size_t j = 0; j + 1 < q; j += 2) pair(g.B2[j], g.B2[j + 1], false);
    if (p % 2 == 1 && q % 2 == 1) pair(g.A1[p - 1], g.A2[q - 1], true);
    else if (p % 2 == 1) single(g.A1[p - 1], true);
    else if (q % 2 == 1) single(g.A2[q - 1], true);
    if (q % 2 == 1) single(g.B2[q - 1], false);
    return g;
}

// A random drive whose response stays below `growth` times its command; its algebraic loop is not next to unsolvable.
inline Drive random_drive(Random& random, LoopKind kind, std::size_t p, std::size_t q, Family family, std::size_t samples,
                          double growth = 1e4) {
    for (;;) {
        Drive d;
        d.sample_time = log_uniform(random, 1e-4, 2e-3);
        d.plant = random_plant(random, p, q, family, d.sample_time, samples);
        d.input = random_signal(random, samples);
        d.loop.kind = kind;
        const Complex crossover(0.0, log_uniform(random, 20.0, 0.3 / d.sample_time));
        Complex shape = 1.0;
        for (const Complex a : d.plant.A1) shape /= crossover + a;
        for (std::size_t j = 0; j < q; ++j) shape *= (crossover + d.plant.B2[j]) / (crossover + d.plant.A2[j]);
        d.loop.controller.kp = log_uniform(random, 1e-3, 10.0);
        d.loop.controller.ki = d.loop.controller.kp * crossover.imag() * uniform(random, 0.02, 0.5);
        d.plant.K = 1.0 / (d.loop.controller.kp * std::abs(shape));
        for (int attempt = 0; attempt < 30; ++attempt, d.loop.controller.kp /= 1.5, d.loop.controller.ki /= 2.0) {
            double G = d.plant.K;  // what a torque does within its own sample
            for (const auto& m : factor_modules<double>(d.plant).modules) G *= DifferenceEquation<double>(m, d.sample_time).g();
            if (kind == LoopKind::continuous &&
                std::abs(1.0 + G * (d.loop.controller.kp + 0.5 * d.loop.controller.ki * d.sample_time)) < 0.2)
                continue;
            const std::vector<double> zero(samples, 0.0), velocity = d.respond<double>().velocity;
            double largest = 0.0;
            for (const double r : d.input) largest = std::max(largest, std::abs(r));
            // A response can be very small as well, where the loop is nearly open: it is scaled up.
            const double size = deviation(velocity, zero);
            if (kind == LoopKind::open) {
                if (size > 0.0 && size < 1e12) return d;
            } else if (size <= growth * largest && size > 1e-6 * largest) {
                return d;
            }
        }
    }
}

// What the paper identified (Table IV), with the controller of Table III scaled as its Table V needs it (docs/paper.md,
// loop gain).
inline Drive paper_drive(bool two_mass) {
    Drive d;
    d.sample_time = 0.444e-3;
    const double scale = two_mass ? 5.5637 : 1.6744;
    d.loop.controller.kp = 0.0232 * scale;
    d.loop.controller.ki = 1.367 * scale;
    d.input.assign(250, 43.6);
    if (two_mass) d.plant = {6545.29, {15.41}, {{10.30, 150.9}, {10.30, -150.9}}, {{4.26, 93.98}, {4.26, -93.98}}};
    else d.plant = {6278.26, {34.13}, {}, {}};
    return d;
}

// A drive's response with white noise on it, as a record.
struct Measurement {
    std::vector<double> input, output;
    double sample_time;

    Measurement(const Drive& d, double noise, std::uint64_t seed) : input(d.input), sample_time(d.sample_time) {
        Random random(seed);
        for (const long double w : d.respond<long double>().velocity)
            output.push_back(static_cast<double>(w) + noise * normal(random));
    }
    Record record() const {
        Record r;
        r.input = input;
        r.output = output;
        r.sample_time = sample_time;
        return r;
    }
};

}  // namespace gaident::reference
