// u(t - delay), any fraction of a sample.
// A held torque delayed is still piecewise constant: over the substep [t, t + h] its mean and its rise are
//
//     (1 - v) u(k) + v u(k+1),   6 v (1 - v) (u(k+1) - u(k)),   x = (t - delay)/T,  k = floor(x),  v = max(0, (x - k) + h/T - 1) T/h
//
// with T the time each torque is held.
#pragma once

#include "../effect.hpp"

#include <cstdio>
#include <stdexcept>
#include <string>

namespace gaident {

inline constexpr double longest_delay = 1.0;       // s
inline constexpr double most_back = 2147483000.0;  // torques: what an int counts, with room for a fraction of one

struct TransportDelay {
    static constexpr EffectParameter parameters[] = {{"delay", "s", 0.0, 0.0, longest_delay}};
    static constexpr EffectInfo info{
        .name = "transport_delay",
        .place = Place::actuator,
        .meaning = "the {torque} acts later than it was commanded",
        .parameters = parameters,
    };
    static constexpr Hooks hooks = Hooks::actuator_dynamics | Hooks::possible | Hooks::tabulate | Hooks::later;

    // The mean over substep j: (1 - share) u(n - back) + share u(n - younger), younger = back - 1 where share is not 0.
    struct Table {
        int back[max_substeps], younger[max_substeps];
        double share[max_substeps];
    };
    static constexpr bool apart = true;
    static constexpr Pace pace = Pace::fine;
    static bool possible(const double* p) { return p[0] >= 0.0 && p[0] <= longest_delay; }
    // A static change of the torque, as saturation and dead band are, commutes with a delay: the controller's delay adds to this one.
    static void later(double* p, double delay) { p[0] += delay; }
    // Torques before the run are all one number: a delay beyond it is one by its length. Of longer runs a table knows `most_back`.
    static void tabulate(const double* p, const PreparedFor& time, Table& table) {
        const double delay = possible(p) ? p[0] : 0.0, torques = delay / time.hold;
        const bool beyond = torques >= time.torques + 1.0;
        if ((beyond ? time.torques : torques) > most_back) throw std::invalid_argument(too_long(delay, time.hold));
        for (int j = 0; j < time.steps; ++j) {
            if (beyond) {
                table.back[j] = static_cast<int>(time.torques);
                table.share[j] = 0.0;
            } else {
                mean(delay, time.hold, j, time.steps, table.back[j], table.share[j]);
            }
            table.younger[j] = table.back[j] > 0 ? table.back[j] - 1 : 0;
        }
    }
    static std::string too_long(double delay, double hold) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "transport_delay: a delay of %g s is %.0f torques of %g s, more than the %.0f that are kept", delay,
                      delay / hold, hold, most_back);
        return text;
    }
    static int reach(const Table& table, int steps) {
        int back = 0;
        for (int j = 0; j < steps; ++j) back = back < table.back[j] ? table.back[j] : back;
        return back;
    }

    // For substep j of m: `back` = -k counted from the present value, `share` = v. At most `most_back` torques.
    static void mean(double delay, double hold, int j, int m, int& back, double& share) {
        const double x = static_cast<double>(j) / m - delay / hold;
        int k = static_cast<int>(x);
        if (static_cast<double>(k) > x) --k;
        const double over = (x - static_cast<double>(k)) * m + 1.0 - m;
        back = -k;
        share = over > 0.0 ? over : 0.0;
        // Rounding may put the present substep slightly before the present value, or ask for one that is not there yet.
        if (back <= 0) {
            back = 0;
            share = 0.0;
        }
    }

    template <class None, class NoState, class Past, class R>
    [[gnu::always_inline]] static Course<R> actuator_dynamics(const None&, NoState&, const Past& past, Course<R>) {
        const auto table = [&](std::size_t lane) -> const Table& { return past.template table<TransportDelay>(lane); };
        const auto before = [&](int back, std::size_t lane) {
            return past.torque(past.newest - static_cast<std::size_t>(back), lane);
        };
        const R from = Pack<R>::gather([&](std::size_t lane) { return before(table(lane).back[past.substep], lane); });
        const R to = Pack<R>::gather([&](std::size_t lane) { return before(table(lane).younger[past.substep], lane); });
        const R share = Pack<R>::gather([&](std::size_t lane) { return table(lane).share[past.substep]; });
        const R change = to - from, mean = fma(change, share, from);
        return {mean, R(6.0) * share * (to - mean)};
    }
};

}  // namespace gaident
