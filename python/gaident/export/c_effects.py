"""The loop with effects in C: one piece of text per place, put together in the order of csrc/gaident/nonlinear/effect_loop.hpp.

The pieces are compared with `gaident.simulate`, effect by effect, in tests/python/test_to_c.py.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["Pieces", "effect_pieces"]

LAW = ("coulomb_friction", "asymmetric_friction", "quadratic_drag")
DRY = (*LAW, "stribeck_friction", "presliding_friction", "friction_drift")


class Pieces:
    """The text of one recurrence: constants and helpers, members of the state, what reset and step do."""

    def __init__(self) -> None:
        self.constants: list[str] = []
        self.members: list[tuple[str, str]] = []
        self.reset: list[str] = []
        self.step: list[str] = []

    def array(self, name: str, values: Sequence[float], what: str) -> None:
        """A constant array."""
        listed = ", ".join(number(v) for v in values)
        self.constants.append(f"static const double {name}[{len(values)}] = {{{listed}}}; /* {what} */")

    def numbers(self, values: Mapping[str, float], what: str) -> None:
        """Constants by name."""
        for name, value in values.items():
            self.constants.append(f"static const double {name} = {number(value)}; /* {what} */")


def number(value: float) -> str:
    """A double as C writes it, all digits."""
    return repr(float(value))


def indented(text: str, by: int) -> str:
    """Lines moved to the right."""
    return "\n".join(" " * by + line if line else "" for line in text.strip("\n").split("\n"))


HELPERS = """
static double clip(double x, double limit) { return x > limit ? limit : x < -limit ? -limit : x; }
"""

FRICTION = """
/* w+ = w_free - beta f: the velocity after the substep under dry friction, which may stop it or hold it. */
static double under_friction(double w, double w_free, double beta, const double level[2], const double viscous[2], double drag,
                             double more_at_rest) {
    const double speed = fabs(w), change = w_free - w;
    const double direction = speed > 0.0 ? w : change, sign = direction > 0.0 ? 1.0 : -1.0;
    const int way = direction > 0.0 ? 0 : 1;
    const double rise = sign * change, B = 0.5 * viscous[way];
    double onward = (speed + rise) - beta * level[way];
    onward = (onward - beta * B * speed) / (1.0 + beta * (B + drag * speed));
    if (onward > 0.0) return sign * onward;
    const double rest = onward / ((onward - speed) - 1e-300); /* share of the substep after the stop */
    const double back = rise + beta * (level[1 - way] + more_at_rest);
    return sign * rest * (back < 0.0 ? back : 0.0);
}
"""

COUPLING = """
/* What play and hardening add to the linear coupling torque, at the twist x and its rate dx. */
static double coupling_correction(double x, double dx) {
    const double beyond = x - clip(x, half_gap);
    return -(K_G * clip(x, half_gap) + (half_gap > fabs(x) ? D_G * dx : 0.0)) + cubic * beyond * beyond * beyond;
}

/* The same, its mean along a twist that goes evenly from x0 to x1. */
static double mean_correction(double x0, double x1, double dx0, double dx1) {
    const double c0 = clip(x0, half_gap), c1 = clip(x1, half_gap), step = x1 - x0;
    const double b0 = x0 - c0, b1 = x1 - c1;
    const double S = c1 * (x1 - 0.5 * c1) - c0 * (x0 - 0.5 * c0);
    const int moves = fabs(step) > 1e-6 * half_gap;
    const double spring = moves ? S / step : 0.5 * (c0 + c1);
    const double share = moves ? (c1 - c0) / step : half_gap > fabs(x0) ? 1.0 : 0.0;
    return -(K_G * spring + D_G * 0.5 * (dx0 + dx1) * share) + 0.5 * cubic * (b0 * b0 * b0 + b1 * b1 * b1);
}
"""

OBSERVER_FREE = """
const double w_free = (s->x[0] + {next} + b[1] * T) - a[0] * s->x[0];
"""

OBSERVER_MOVE = """
for (i = 1; i + 1 < ORDER; ++i) s->x[i] = (s->x[i] + s->x[i + 1] + b[i + 1] * T) - a[i] * w;
if (ORDER > 1) s->x[ORDER - 1] = (s->x[ORDER - 1] + b[ORDER] * T) - a[ORDER - 1] * w;
s->x[0] = w_next;
"""

MASSES_FREE = """
double part[3];
for (i = 0; i < 3; ++i)
    part[i] = s->x[i] + phi[3 * i] * s->x[0] + phi[3 * i + 1] * s->x[1] + phi[3 * i + 2] * s->x[2];
const double x0 = s->x[2] * per_scale, dx0 = s->x[0] - s->x[1];
const double now = coupling_correction(x0, dx0), total = T - s->friction;
const double x1 = (part[2] + motor[2] * total + coupling[2] * now) * per_scale;
const double dx1 = (part[0] - part[1]) + (motor[0] - motor[1]) * total + (coupling[0] - coupling[1]) * now;
const double correction = mean_correction(x0, x1, dx0, dx1);
const double w_free = part[0] + motor[0] * T + coupling[0] * correction;
"""

MASSES_MOVE = """
s->x[1] = part[1] + motor[1] * T + coupling[1] * correction;
s->x[2] = part[2] + motor[2] * T + coupling[2] * correction;
s->x[0] = w_next;
"""

STRIBECK = """
{
    const double foreseen = w + 0.5 * (w - s->w_before), middle = w * foreseen > 0.0 ? foreseen : 0.0;
    const double x = middle * slowness, hump = (static_torque - stribeck_torque) * exp(-x * x);
    level[0] += stribeck_torque + hump;
    level[1] += stribeck_torque + hump;
    more_at_rest = static_torque - (stribeck_torque + hump);
    s->w_before = w;
}
"""

DRIFT = """
level[0] += drift_torque * {part};
level[1] += drift_torque * {part};
"""

JOIN = """
/* the bristle, solved jointly with the velocity: afterwards free and beta are those of the other friction alone */
const double turned = h * fabs(w) * per_break, springy = beta * h * bristle_stiffness;
const double theta_b = 1.0 - 1.0 / (2.0 + turned / 3.0 + 0.058 * turned * turned + 0.5 * springy), e_b = theta_b * h;
const double ez = e_b * per_break, k_b = theta_b * beta * bristle_stiffness;
const double A_b = w + theta_b * ((w_free - w) - beta * s->other_friction), drive = A_b - k_b * s->z;
const double c_b = fabs(drive), b_b = (1.0 + k_b * e_b) - (drive > 0.0 ? A_b : -A_b) * ez;
const double q_b = fabs(b_b) + sqrt(b_b * b_b + 4.0 * ez * c_b);
const double V_b = b_b > 0.0 ? 2.0 * c_b / q_b : q_b / (2.0 * ez), one_plus = 1.0 + ez * V_b;
const double slope = bristle_stiffness * e_b / one_plus, stiffer = 1.0 + beta * slope * theta_b;
free = (w_free - beta * (bristle_stiffness * s->z / one_plus + slope * (1.0 - theta_b) * w)) / stiffer;
beta /= stiffer;
"""

BRISTLE_MOVE = """
s->other_friction = (free - w_next) / beta;
{
    const double W = w + theta_b * (w_next - w), zm = (s->z + e_b * W) / one_plus;
    s->z = clip(s->z + (zm - s->z) / theta_b, 1.0 / per_break);
}
"""


def effect_pieces(pieces: Pieces, found: Mapping[str, Any], dt: float, pi: Sequence[str] | None) -> None:
    """Fills in the recurrence with effects. found: what the core says; pi: the lines of the controller, None in open loop."""
    effects: dict[str, Sequence[float]] = dict(found["effects"])
    if "delay" in found:
        effects["transport_delay"] = ()
    substeps = found["substeps"]
    two = "phi" in found
    dry = any(name in effects for name in ("law", *DRY[len(LAW) :]))
    turning = any(name in effects for name in ("unbalance", "cogging", "velocity_ripple"))
    pieces.constants.append(f"enum {{ SUBSTEPS = {substeps} }};")
    pieces.numbers({"h": dt / substeps}, "substep [s]")
    pieces.members += [("double angle", "rad, of the motor, from 0")]
    _plant(pieces, found, two, dry)
    _constants(pieces, effects)
    if dry:
        pieces.constants.append(FRICTION.strip())
    sensor = _sensor(pieces, effects)
    step = pieces.step
    if "velocity_ripple" in effects:
        step.append("double theta = s->angle;")
    step.append(f"const double y = {sensor};")
    step.append("int i, j;")
    step += _controller(pieces, effects, pi)
    step += ["s->velocity = y;", "s->torque = u;"]
    if "torque_saturation" in effects:
        step.append("u = clip(u, saturation);")
    if "torque_dead_band" in effects:
        step.append("u -= clip(u, dead_band);")
    if "transport_delay" in effects:
        _delay(pieces, found["delay"])
    step.append("for (j = 0; j < SUBSTEPS; ++j) {")
    step.append(indented("\n".join(_substep(pieces, effects, two, dry, turning)), 4))
    step += ["}", "(void)i;", "return y;"]


def _plant(pieces: Pieces, found: Mapping[str, Any], two: bool, dry: bool) -> None:
    if two:
        pieces.constants.append("enum { ORDER = 3 };")
        pieces.array("phi", found["phi"], "e^(A h) - 1 over motor velocity, load velocity, twist to scale")
        pieces.array("motor", found["motor"], "response to 1 N m at the motor")
        pieces.array("coupling", found["coupling"], "response to 1 N m more in the coupling")
        names = ("K_G", "D_G", "per_scale", "half_gap", "cubic")
        pieces.numbers(dict(zip(names, found["shaft"], strict=True)), "shaft")
        pieces.constants.append(COUPLING.strip())
        pieces.members.append(("double friction", "N m, of the substep before"))
        pieces.reset.append("s->friction = 0.0;")
    else:
        pieces.constants.append(f"enum {{ ORDER = {len(found['a'])} }};")
        pieces.array("a", found["a"], "denominator in delta = z - 1, at the substep")
        pieces.array("b", found["b"], "numerator")
    pieces.members.append((f"double x[{3 if two else len(found['a'])}]", "the mechanism"))


def _constants(pieces: Pieces, effects: Mapping[str, Sequence[float]]) -> None:
    names: dict[str, tuple[str, ...]] = {
        "stribeck_friction": ("stribeck_torque", "static_torque", "slowness"),
        "presliding_friction": ("bristle_torque", "bristle_stiffness", "per_break"),
        "friction_drift": ("drift_torque", "drift_rate"),
        "load_torque": ("load",),
        "unbalance": ("unbalance_amplitude", "unbalance_phase"),
        "cogging": ("cogging_amplitude", "cogging_order", "cogging_phase"),
        "torque_saturation": ("saturation",),
        "torque_dead_band": ("dead_band",),
        "torque_lag": ("lag_decay", "lag_mean"),
        "command_rate_limit": ("rate_step",),
        "velocity_filter": ("filter_decay", "filter_old", "filter_new"),
        "velocity_ripple": ("ripple_amplitude", "ripple_order", "ripple_phase"),
        "velocity_quantisation": ("quantum",),
    }
    for effect, values in effects.items():
        if effect in names:
            used = dict(zip(names[effect], values, strict=True))
            used.pop("bristle_torque", None)  # is stiffness / per_break
            pieces.numbers(used, effect)


def _sensor(pieces: Pieces, effects: Mapping[str, Sequence[float]]) -> str:
    """The expression of the measured velocity."""
    rippled = "s->x[0]"
    if "velocity_ripple" in effects:
        pieces.constants.append(
            "static double rippled(double w, double theta) {\n"
            "    return w * (1.0 + ripple_amplitude * ripple_order * cos(ripple_order * theta + ripple_phase));\n}"
        )
        rippled = "rippled(s->x[0], theta)"
    seen = rippled
    if "velocity_filter" in effects:
        pieces.members += [("double filtered", "rad/s"), ("double filter_input", "rad/s")]
        pieces.reset += ["s->filtered = 0.0;", "s->filter_input = 0.0;"]
        seen = "s->filtered"
    if "velocity_quantisation" in effects:
        seen = f"nearbyint({seen} / quantum) * quantum"
    return seen


def _controller(pieces: Pieces, effects: Mapping[str, Sequence[float]], pi: Sequence[str] | None) -> list[str]:
    if pi is None:
        return ["double u = input;"]
    lines = ["double r = input;"]
    if "command_rate_limit" in effects:
        pieces.members.append(("double command", "rad/s, as the controller follows it"))
        pieces.reset.append("s->command = 0.0;")
        lines.append("r = s->command += clip(r - s->command, rate_step);")
    pieces.members.append(("double stored", "N m, of the controller"))
    pieces.reset.append("s->stored = 0.0;")
    return lines + list(pi)


def _delay(pieces: Pieces, table: tuple[Sequence[int], Sequence[float]]) -> None:
    back, share = table
    length = max(back) + 1
    pieces.constants.append(f"enum {{ HISTORY = {length} }};")
    listed = ", ".join(str(b) for b in back)
    pieces.constants.append(f"static const int back[{len(back)}] = {{{listed}}}; /* samples, per substep */")
    pieces.array("share", share, "of the younger of two torques")
    pieces.members += [(f"double issued[{length}]", "N m, the newest at `newest`"), ("int newest", "")]
    pieces.reset += ["for (i = 0; i < HISTORY; ++i) s->issued[i] = 0.0;", "s->newest = 0;"]
    pieces.step += ["s->newest = (s->newest + 1) % HISTORY;", "s->issued[s->newest] = u;"]


def _substep(pieces: Pieces, effects: Mapping[str, Sequence[float]], two: bool, dry: bool, turning: bool) -> list[str]:
    torque_turns = "unbalance" in effects or "cogging" in effects
    lines = ["const double w = s->x[0];", "double T = u, w_next;"]
    if "transport_delay" in effects:
        lines += [
            "const double old = s->issued[(s->newest - back[j] + HISTORY) % HISTORY];",
            "const double young = s->issued[(s->newest - back[j] + (back[j] > 0) + HISTORY) % HISTORY];",
            "T = old + (young - old) * share[j];",
        ]
    if "torque_lag" in effects:
        pieces.members.append(("double lagging", "N m"))
        pieces.reset.append("s->lagging = 0.0;")
        lines += [
            "{",
            "    const double gap = s->lagging - T;",
            "    s->lagging = T + gap * lag_decay;",
            "    T += gap * lag_mean;",
            "}",
        ]
    if "load_torque" in effects:
        lines.append("T -= load;")
    if torque_turns:
        pieces.members.append(("double theta", "rad, in the middle of the substep, foreseen"))
        pieces.reset.append("s->theta = 0.0;")
        if "unbalance" in effects:
            lines.append("T -= unbalance_amplitude * sin(s->theta + unbalance_phase);")
        if "cogging" in effects:
            lines.append("T -= cogging_amplitude * sin(cogging_order * s->theta + cogging_phase);")
        lines.append("s->theta = s->angle + 1.5 * h * w;")
    order_one = any(m[0] == "double x[1]" for m in pieces.members)
    free = MASSES_FREE if two else OBSERVER_FREE.replace("{next}", "0.0" if order_one else "s->x[1]")
    lines += free.strip("\n").split("\n")
    if dry:
        lines += _friction(pieces, effects, two)
    else:
        lines.append("w_next = w_free;")
    lines += (MASSES_MOVE if two else OBSERVER_MOVE).strip("\n").split("\n")
    lines.append("s->angle += 0.5 * h * (w + w_next);")
    if "velocity_filter" in effects:
        now = "s->x[0]"
        if "velocity_ripple" in effects:
            lines.append("theta = s->angle;")
            now = "rippled(s->x[0], theta)"
        lines += [
            "{",
            f"    const double now = {now};",
            "    s->filtered = filter_decay * s->filtered + filter_old * s->filter_input + filter_new * now;",
            "    s->filter_input = now;",
            "}",
        ]
    return lines


def _friction(pieces: Pieces, effects: Mapping[str, Sequence[float]], two: bool) -> list[str]:
    positive, negative, b_positive, b_negative, drag = effects.get("law", (0.0,) * 5)
    pieces.array("viscous", (b_positive, b_negative), "N m s/rad, forwards and backwards")
    lines = [
        f"double level[2] = {{{number(positive)}, {number(negative)}}}, more_at_rest = 0.0; /* N m */",
        f"double beta = {'motor[0]' if two else 'b[1]'}, free = w_free;",
    ]
    if "presliding_friction" in effects:
        pieces.members += [("double z", "rad, of the bristle"), ("double other_friction", "N m")]
        pieces.reset += ["s->z = 0.0;", "s->other_friction = 0.0;"]
        lines += JOIN.strip("\n").split("\n")
    if "friction_drift" in effects:
        pieces.members.append(("double time", "s"))
        pieces.reset.append("s->time = 0.0;")
        lines += ["s->time += h;"]
        lines += DRIFT.strip("\n").replace("{part}", "fmax(1.0 + drift_rate * (s->time - 0.5 * h), 0.0)").split("\n")
    if "stribeck_friction" in effects:
        pieces.members.append(("double w_before", "rad/s"))
        pieces.reset.append("s->w_before = 0.0;")
        lines += STRIBECK.strip("\n").split("\n")
    lines.append(f"w_next = under_friction(w, free, beta, level, viscous, {number(drag)}, more_at_rest);")
    if "presliding_friction" in effects:
        lines += BRISTLE_MOVE.strip("\n").split("\n")
    whole = "motor[0]" if two else "b[1]"
    if two:
        lines += [f"s->friction = (w_free - w_next) / {whole};", "T -= s->friction;"]
    else:
        lines.append(f"T -= (w_free - w_next) / {whole};")
    return lines
