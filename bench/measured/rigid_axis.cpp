// A rigid axis under a torque that is held over each sample, solved exactly piece by piece; shares no code with the library.
//
//   J dw/dt = u - B(w) w - C(w) sign(w) - T - As sin(theta) - Ac cos(theta),   dtheta/dt = w
//
// B+, C+ hold for w > 0, B-, C- for w < 0. At rest the axis stays as long as the other torques lie between -C- and C+.
// With gravity a sample is cut into `substeps` equal pieces, the angle of their middle taken for each (second order): the
// logged angle where there is one, as the library does, or the own error of an unstable axis would be all that is seen.
// Without gravity one piece is exact.
// Called by bench/measured/real_fits.py, compiled when it is first needed (tests/python/support/compiled.py).

#include <cmath>
#include <cstdint>

namespace {

struct Axis {
  double J, Bp, Bn, Cp, Cn, T, As, Ac;
};

struct Motion {
  double w, theta;
};

// Moves with the sign s for at most `time`, under the constant torque u; returns the time used: less where w reaches 0.
double slide(const Axis& axis, int s, double u, double time, Motion& m) {
  const double rate = (s > 0 ? axis.Bp : axis.Bn) / axis.J;
  const double push = (u - (s > 0 ? axis.Cp : -axis.Cn)) / axis.J;
  const double x = rate * time;
  // w(t) = w e^-rt + push (1 - e^-rt)/r, continued to r = 0
  const double decay = std::exp(-x);
  const double phi = x > 1e-8 ? -std::expm1(-x) / rate : time * (1.0 - 0.5 * x);
  const double end = m.w * decay + push * phi;
  if (s * end >= 0.0) {
    m.theta += x > 1e-8 ? (push * time + m.w - end) / rate : time * (m.w + 0.5 * push * time);
    m.w = end;
    return time;
  }
  // w = 0 at t = ln(1 - r w/push)/r
  const double ratio = -m.w / push;
  const double stop = rate * ratio > 1e-8 ? std::log1p(rate * ratio) / rate : ratio;
  m.theta += 0.5 * m.w * stop;
  m.w = 0.0;
  return stop < time ? stop : time;
}

// One piece with constant torque; at most a few changes of sign.
void advance(const Axis& axis, double u, double time, Motion& m) {
  for (int change = 0; change < 4 && time > 0.0; ++change) {
    int s = m.w > 0.0 ? 1 : m.w < 0.0 ? -1 : u > axis.Cp ? 1 : u < -axis.Cn ? -1 : 0;
    if (s == 0) return;
    time -= slide(axis, s, u, time, m);
  }
}

}  // namespace

// axis: the eight numbers of Axis. start: w and theta. angle: n logged angles, or null. velocity: n values at the samples,
// before their torque acts.
extern "C" void rigid_axis_run(const double* axis, const double* start, const double* torque, const double* angle,
                               std::int64_t n, double dt, int substeps, double* velocity) {
  const Axis a{axis[0], axis[1], axis[2], axis[3], axis[4], axis[5], axis[6], axis[7]};
  Motion m{start[0], start[1]};
  const bool gravity = a.As != 0.0 || a.Ac != 0.0;
  const int pieces = gravity ? substeps : 1;
  const double h = dt / pieces;
  for (std::int64_t i = 0; i < n; ++i) {
    velocity[i] = m.w;
    for (int k = 0; k < pieces; ++k) {
      double u = torque[i] - a.T;
      if (gravity) {
        const double share = (k + 0.5) / pieces;
        const double middle = angle != nullptr ? angle[i] + share * (angle[i + 1 < n ? i + 1 : i] - angle[i])
                                               : m.theta + 0.5 * h * m.w;
        u -= a.As * std::sin(middle) + a.Ac * std::cos(middle);
      }
      advance(a, u, h, m);
    }
  }
}
