// A discrete transfer function seen at every r-th sample only: the same kind of difference equation, of the same order.
//
// With z = 1 + delta and e = z^r - 1, which is delta at the slower rate, w a r-th root of unity, and N/D the transfer function:
//
//     D'(e)                  = prod_w D(w z - 1)                                      every pole to the power r
//     r z^(r-1) N'(e)        = sum_w w N(w z - 1) K(w z) prod_(v != w) D(v z - 1)     each product over leading coefficients 1
//     K(z) = S(z) = 1 + z + ... + z^(r-1)     where the input is held between the slower samples
//     K(z) = S(z)^2 / r                       where it goes straight from one of them to the next
//
// Both are worked out for the prime factors of r, one after the other: inputs that are held stay held, straight ones straight.
// For r = 2 with c~(delta) = (-1)^n c(-2 - delta), n the order:
//
//     D' = D D~,   2 z N' = N D~ (2 + delta) + N~ D delta   or   N D~ (2 + delta)^2/2 - N~ D delta^2/2
//
// From the lowest power on: e = r delta + ..., so that the coefficient of e^k is what the lower ones leave of that of delta^k.
// For poles inside the unit circle both sides of the first line have positive coefficients, and those that are small,
// of poles near z = 1, are made of small numbers alone. In powers of z they would be lost.
#pragma once

#include "delta.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>
#include <type_traits>
#include <vector>

namespace gaident {

// What an input does between two of the slower samples; mixed: the sum of one that is held and one that goes straight.
enum class Between : std::uint8_t { held, straight, mixed };

// c[0] + c[1] delta + ... + c[max_loop_order] delta^max_loop_order
template <class R>
struct Powers {
    R c[max_loop_order + 1];
};

class Decimation {
public:
    explicit Decimation(int every) {
        if (every < 1) throw std::invalid_argument("every must be 1 or more");
        for (int p = 2; every > 1; ++p)
            for (; every % p == 0; every /= p) {
                if (p > 2 * most_pairs + 1) throw std::invalid_argument("every: its prime factors go to 31");
                steps_.push_back(Step(p));
            }
    }

    // One denominator, whose leading coefficient is 1, and for each numerator how its input behaves; in place.
    template <class R>
    void operator()(int order, Powers<R>& denominator, Powers<R>* numerator, const Between* between, int numerators) const {
        with_order(order, [&](auto constant) {
            constexpr int N = constant;
            for (const Step& s : steps_)
                if (s.p == 2) s.template halve<N>(order, denominator, numerator, between, numerators);
                else s(order, denominator, numerator, between, numerators);
        });
    }

private:
    static constexpr int terms = max_loop_order + 1, most_pairs = 15;
    using Row = double[terms];

    // Calls call(std::integral_constant<int, n>) for usual orders, so that loops over coefficients unroll; with -1 for larger ones.
    template <int n = 1, class Call>
    static void with_order(int order, Call&& call) {
        if constexpr (n > 8) return call(std::integral_constant<int, -1>{});
        else if (order == n) return call(std::integral_constant<int, n>{});
        else return with_order<n + 1>(order, call);
    }

    template <class R>
    struct Complex {
        Powers<R> re, im;
    };

    // By a prime p.
    struct Step {
        struct Root {
            double re, im;
            Row kernel_re[2], kernel_im[2];  // w K(w z) in powers of delta: held, straight
        };

        int p;
        int pairs = 0;
        Root roots[most_pairs];   // the roots of unity with a positive angle; of their conjugates nothing is needed
        Row kernel[2]{};          // K(z)
        Row split[terms]{};       // of each power of e the coefficients in delta
        Row split_lead[terms]{};  // the same, times p z^(p-1)

        explicit Step(int prime) : p(prime) {
            const double q = p;
            // Binomial coefficients of z^(p-1), one row in powers of delta.
            std::vector<std::vector<double>> z(static_cast<std::size_t>(p) + 1, std::vector<double>(1, 1.0));
            for (std::size_t k = 1; k < z.size(); ++k) {
                z[k].assign(k + 1, 1.0);
                for (std::size_t i = 1; i < k; ++i) z[k][i] = z[k - 1][i - 1] + z[k - 1][i];
            }
            const auto term = [&](std::size_t power, int i) {
                return static_cast<std::size_t>(i) <= power ? z[power][static_cast<std::size_t>(i)] : 0.0;
            };
            const auto last = static_cast<std::size_t>(p);
            for (int i = 0; i < terms; ++i) {
                split[0][i] = i == 0 ? 1.0 : 0.0;
                split_lead[0][i] = q * term(last - 1, i);
                kernel[0][i] = term(last, i + 1);
            }
            times(kernel[0], kernel[0], 1.0 / q, kernel[1]);
            Row e;
            for (int i = 0; i < terms; ++i) e[i] = i == 0 ? 0.0 : term(last, i);
            for (int k = 1; k < terms; ++k) {
                times(split[k - 1], e, 1.0, split[k]);
                times(split_lead[k - 1], e, 1.0, split_lead[k]);
            }
            for (int k = 1; 2 * k < p; ++k, ++pairs) {
                const double angle = 2.0 * std::numbers::pi * k / q;
                const auto power = [&](int j, double& re, double& im) {
                    re = std::cos(angle * j);
                    im = std::sin(angle * j);
                };
                Root& r = roots[pairs];
                r = {};
                power(1, r.re, r.im);
                Row s_re{}, s_im{};  // S(w z); its first coefficient is exactly 0
                for (int j = 0; j < p; ++j) {
                    double re = 0.0, im = 0.0;
                    power(j, re, im);
                    for (int i = 1; i < terms; ++i) {
                        s_re[i] += re * term(static_cast<std::size_t>(j), i);
                        s_im[i] += im * term(static_cast<std::size_t>(j), i);
                    }
                }
                Row rr, ii, ri;
                times(s_re, s_re, 1.0 / q, rr);
                times(s_im, s_im, 1.0 / q, ii);
                times(s_re, s_im, 2.0 / q, ri);
                for (int i = 0; i < terms; ++i) {
                    const double re[2] = {s_re[i], rr[i] - ii[i]}, im[2] = {s_im[i], ri[i]};
                    for (int kind = 0; kind < 2; ++kind) {
                        r.kernel_re[kind][i] = r.re * re[kind] - r.im * im[kind];
                        r.kernel_im[kind][i] = r.re * im[kind] + r.im * re[kind];
                    }
                }
            }
        }

        static void times(const Row& x, const Row& y, double scale, Row& out) {
            for (int i = 0; i < terms; ++i) {
                double sum = 0.0;
                for (int j = 0; j <= i; ++j) sum += x[j] * y[i - j];
                out[i] = scale * sum;
            }
        }

        // Coefficients 0 ... n of the product.
        template <class R>
        static void times(int n, const Powers<R>& x, const Powers<R>& y, Powers<R>& out) {
            for (int i = 0; i <= n; ++i) {
                R sum = x.c[0] * y.c[i];
                for (int j = 1; j <= i; ++j) sum = fma(x.c[j], y.c[i - j], sum);
                out.c[i] = sum;
            }
        }
        template <class R>
        void times_row(int n, const Row& x, const Powers<R>& y, Powers<R>& out) const {
            const int degree = 2 * (p - 1);
            for (int i = 0; i <= n; ++i) {
                R sum = R(x[0]) * y.c[i];
                for (int j = 1; j <= i && j <= degree; ++j) sum = fma(R(x[j]), y.c[i - j], sum);
                out.c[i] = sum;
            }
        }

        // x(w (1 + delta) - 1) by Horner.
        template <class R>
        static void turn(int n, const Powers<R>& x, const Root& w, Complex<R>& out) {
            const R zero(0.0), wr(w.re), wi(w.im), cr(w.re - 1.0);
            for (int i = 0; i <= n; ++i) out.re.c[i] = out.im.c[i] = zero;
            out.re.c[0] = x.c[n];
            for (int k = n - 1; k >= 0; --k) {
                for (int i = n - k; i >= 0; --i) {
                    const bool low = i > 0;
                    const R re = out.re.c[i], before_re = low ? out.re.c[i - 1] : zero;
                    const R im = out.im.c[i], before_im = low ? out.im.c[i - 1] : zero;
                    out.im.c[i] = (cr * im + wr * before_im) + (wi * re + wi * before_re);
                    out.re.c[i] = (cr * re + wr * before_re) - (wi * im + wi * before_im);
                }
                out.re.c[0] = out.re.c[0] + x.c[k];
            }
        }

        // (-1)^n c(-2 - delta) by Horner; of a denominator with leading coefficient 1 that of the result is 1.
        template <class R>
        static void mirror(int n, const Powers<R>& x, Powers<R>& out) {
            out.c[0] = x.c[n];
            for (int k = n - 1; k >= 0; --k) {
                const int last = n - 1 - k;
                out.c[last + 1] = out.c[last];
                for (int i = last; i > 0; --i) out.c[i] = (out.c[i] + out.c[i]) + out.c[i - 1];
                out.c[0] = out.c[0] + out.c[0];
                out.c[0] = (n - k) % 2 == 0 ? R(out.c[0] + x.c[k]) : R(out.c[0] - x.c[k]);
            }
        }

        // For p = 2. N: the order when known at compile time, -1 otherwise.
        template <int N, class R>
        void halve(int order, Powers<R>& D, Powers<R>* numerator, const Between* between, int numerators) const {
            const int n = N >= 0 ? N : order;
            const R zero(0.0), half(0.5);
            Powers<R> opposite, far, near_part, far_part, sum;
            mirror(n, D, opposite);
            for (int m = 0; m < numerators; ++m) {
                mirror(n, numerator[m], far);
                times(n, numerator[m], opposite, near_part);
                times(n - 1, far, D, far_part);
                const R *const x = near_part.c, *const y = far_part.c;
                for (int i = 0; i <= n; ++i) {
                    const R x1 = i > 0 ? x[i - 1] : zero, twice = x[i] + x[i];
                    if (between[m] == Between::held) {
                        sum.c[i] = twice + (i > 0 ? R(x1 + y[i - 1]) : zero);
                    } else {
                        const R second = i > 1 ? R(half * (x[i - 2] - y[i - 2])) : zero;
                        sum.c[i] = (twice + (x1 + x1)) + second;
                    }
                }
                in_powers_of_e<R, 1>(n, split_lead, sum);
                numerator[m] = sum;
            }
            times(n - 1, D, opposite, sum);
            in_powers_of_e<R, 0>(n - 1, split, sum);
            sum.c[n] = R(1.0);
            D = sum;
        }

        // What multiplies the powers of e in `sum`, each of which starts with its own power of delta.
        // `lead`: degree of what is multiplied, where p = 2; -1: any p.
        template <class R, int lead = -1>
        static void in_powers_of_e(int n, const Row* rows, Powers<R>& sum) {
            for (int k = 0; k <= n; ++k) {
                const R found = sum.c[k] = sum.c[k] * R(1.0 / rows[k][k]);
                const int last = lead < 0 || 2 * k + lead > n ? n : 2 * k + lead;
                for (int i = k + 1; i <= last; ++i) sum.c[i] = fnma(R(rows[k][i]), found, sum.c[i]);
            }
        }

        template <class R>
        void operator()(int n, Powers<R>& D, Powers<R>* N, const Between* between, int numerators) const {
            // Of each root and its conjugate: D(w z - 1), and the product of the two.
            Complex<R> turned[most_pairs];
            Powers<R> both[most_pairs];
            for (int k = 0; k < pairs; ++k) {
                turn(n, D, roots[k], turned[k]);
                Powers<R> square;
                times(n, turned[k].re, turned[k].re, both[k]);
                times(n, turned[k].im, turned[k].im, square);
                for (int i = 0; i <= n; ++i) both[k].c[i] = both[k].c[i] + square.c[i];
            }
            // The product of all but root k and its conjugate; k = pairs: of all but 1.
            const auto others = [&](int without, Powers<R>& out) {
                bool begun = without < pairs;
                if (begun) out = D;
                for (int k = 0; k < pairs; ++k) {
                    if (k == without) continue;
                    if (begun) {
                        const Powers<R> before = out;
                        times(n, before, both[k], out);
                    } else {
                        out = both[k];
                    }
                    begun = true;
                }
            };
            Powers<R> all_but_one;
            others(pairs, all_but_one);
            for (int m = 0; m < numerators; ++m) {
                const int kind = between[m] == Between::held ? 0 : 1;
                Powers<R> sum, part, product;
                times_row(n, kernel[kind], N[m], part);
                times(n, part, all_but_one, sum);
                for (int k = 0; k < pairs; ++k) {
                    const Root& w = roots[k];
                    Complex<R> x;
                    turn(n, N[m], w, x);
                    Powers<R> re, im, other;
                    times_row(n, w.kernel_re[kind], x.re, re);
                    // 2 Re(w K N(w z - 1) times the conjugate of D(w z - 1))
                    times_row(n, w.kernel_im[kind], x.im, part);
                    for (int i = 0; i <= n; ++i) re.c[i] = re.c[i] - part.c[i];
                    times_row(n, w.kernel_re[kind], x.im, im);
                    times_row(n, w.kernel_im[kind], x.re, part);
                    for (int i = 0; i <= n; ++i) im.c[i] = im.c[i] + part.c[i];
                    times(n, re, turned[k].re, part);
                    times(n, im, turned[k].im, product);
                    for (int i = 0; i <= n; ++i) part.c[i] = R(2.0) * (part.c[i] + product.c[i]);
                    others(k, other);
                    times(n, part, other, product);
                    for (int i = 0; i <= n; ++i) sum.c[i] = sum.c[i] + product.c[i];
                }
                in_powers_of_e(n, split_lead, sum);
                N[m] = sum;
            }
            Powers<R> power;
            times(n, D, all_but_one, power);
            in_powers_of_e(n, split, power);
            power.c[n] = R(1.0);
            D = power;
        }
    };

    std::vector<Step> steps_;
};

}  // namespace gaident
