"""The next experiment: the command of the menu on which the wrong one of two explanations would fail most clearly.

One explanation A at its estimate is simulated in the loop without noise; the other one, B, is fitted to that record, its base
parameters included, as the diagnosis would fit it:

    T(A|B) = min over x_B of |v_B|^2 / s^2,   s^2 = V/N,   margin = N ln(1 + T/N)

v whitened by the noise filter of the diagnosed record, V and N of its final fit.
A pair's T is the smaller one of both directions, because it is not known which effect is true.
Where B contains A only B is simulated, because it can follow any motion of A. The command's T is that of its worst pair.
Of effects that act alike on every record one is tried for all: what tells it from A tells them too, and nothing tells them apart.
Without the fit of the rival every experiment would look good (T-optimal design, Atkinson and Fedorov).

A loop that a position drives gets the path that a command makes.
Under any controller but a bare PI every command is simulated first, and made smaller until the torque is within its limit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, called, joined, say
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.data.torque_kind import COMMANDED, MEASURED
from gaident.diagnosis.experiments.first_experiment import MenuItem, candidate_commands
from gaident.diagnosis.library.equivalences import EQUIVALENT, equivalents
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.rivals import Replacement
from gaident.errors import GaidentError
from gaident.estimation.dataset import DataSet
from gaident.estimation.least_squares import fit as fitted
from gaident.estimation.noise_model import NoiseFilter
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.prediction import ClosedLoop, OpenLoop
from gaident.estimation.projection import WORST, project_out
from gaident.models.drive_torque import driven_by
from gaident.models.effect_rows import SIDES
from gaident.models.simulate import run
from gaident.policy.table import POLICY
from gaident.results.experiment import Limits, Proposal
from gaident.results.finding import Finding

__all__ = ["propose"]

Vector = NDArray[np.float64]


def _listed(effects: Sequence[str]) -> Text:
    """'a, b and c', as people write the names."""
    names = [called(e) for e in effects]
    return joined(" and ", filter(None, (joined(", ", names[:-1]), *names[-1:])))


@dataclass(frozen=True)
class _Bench:
    """What a proposed command is tried on."""

    controller: Controller
    noise: NoiseFilter
    variance: float  # of the whitened noise
    torque_is: str | None  # "commanded" or "measured", as in the diagnosed records; None where they log none
    elsewhere: Mapping[str, Mapping[str, float]]  # effects at the controller, known from the replay

    def record(self, fit: Fit, item: MenuItem) -> Record | None:
        """The noise-free record of one explanation; None where it diverges."""
        model = fit.parameters.model(fit.x)
        for name, values in self.elsewhere.items():
            model = model.with_effect(name, **values)
        asked = self._asked(item)
        with np.errstate(over="ignore", invalid="ignore"):
            done = run(model, asked, self.controller)
        if not (np.all(np.isfinite(done.velocity)) and np.all(np.isfinite(done.torque))):
            return None
        made = asked.with_channels(velocity=done.velocity)
        if self.torque_is is not None:
            made = made.with_channels(torque=done.torque, torque_is=self.torque_is)
        # The torque behind a known delay is what drives a model, as it was in the diagnosed records.
        return made if self.controller.one_equation else driven_by(made.with_channels(torque=done.torque), self.controller)

    def _asked(self, item: MenuItem) -> Record:
        """A record of the signal that drives the loop, at rest."""
        still = np.zeros(len(item.command))
        if item.position_command is None:
            return Record(item.dt, command=item.command, velocity=still)
        return Record(item.dt, position_command=item.position_command, velocity=still)

    def within(self, item: MenuItem, fit: Fit, torque: float) -> MenuItem | None:
        """The item, made smaller until the loop asks for no more than this torque [N m]; None where none is small enough."""
        model, free = fit.parameters.model(fit.x), self.controller.with_limits(None, None)
        for _ in range(POLICY.smaller_commands):
            with np.errstate(over="ignore", invalid="ignore"):
                most = float(np.abs(run(model, self._asked(item), free).torque).max())
            if most <= torque:
                return item
            if not np.isfinite(most):
                return None
            item = item.scaled(POLICY.used_share * torque / most)
        return None

    def left(self, record: Record, rival: Fit, refitted: bool) -> float:
        """T of the rival, fitted to the other explanation's record (or its linearised fit, which costs one step)."""
        data = DataSet.of([record], self.controller)
        objective = Objective(data, np.ones(len(record)))
        hypothesis, x = at_rest(rival, data)
        if refitted:
            cost = fitted(objective, hypothesis, x, self.noise, POLICY.short).cost
        else:
            v, J = objective.linearised(hypothesis, x, self.noise)
            rest = project_out(J, v[None, :])[0]
            cost = float(rest @ rest) if np.all(np.isfinite(rest)) else WORST
        return cost / self.variance


def _keys_of(finding: Finding, keys: Sequence[str]) -> list[str]:
    """The effects of a model that a finding names; of one at both ends of the shaft that at its own."""
    named = [k for k in keys if name_of(k) == finding.effect]
    return named if len(named) < 2 else [k for k in named if (k != finding.effect) == (finding.sides == SIDES[1:])]


def propose(
    findings: Sequence[Finding],
    rivals: Mapping[str, tuple[float, Sequence[Replacement]]],
    final: Fit,
    data: DataSet,
    count: float,
    elsewhere: Mapping[str, Mapping[str, float]],
) -> tuple[Proposal | None, list[Text]]:
    """(the experiment that separates the rivals of ambiguous findings, None where there is none; what to say beside it).

    rivals: effect -> (its gain, the explanations in its place); final: the diagnosed model; count: samples behind its cost;
    elsewhere: effects at the controller, effect -> parameter -> value.
    """
    possible = {name for f in findings for name in (f.effect, *f.alternatives)}
    notes = [e.otherwise for e in EQUIVALENT if any(e.effects <= {f.effect, *f.alternatives} for f in findings)]
    pairs = [
        (effect, rival)
        for f in findings
        for effect in _keys_of(f, list(rivals))
        for rival in rivals[effect][1]
        if name_of(rival.effect) not in (f.effect, *equivalents(f.effect))
    ]
    pairs = _one_of_each_class(sorted(pairs, key=lambda p: p[1].behind))[: POLICY.starts]
    if not pairs:
        return None, notes
    names = _named(pairs)
    controller = data.controller
    if controller is None or (data.pi is not None and data.command is None):
        text = (
            "Without a controller no command can be worked out that tells {} apart: give the controller, and a log with the "
            "velocity command."
        )
        return None, [*notes, say(text, _listed(names))]
    kind = None if not data.torque_logged else MEASURED if data.torque_measured else COMMANDED
    bench = _Bench(controller, final.noise, max(final.cost / count, 1e-300), kind, elsewhere)
    items = menu(data, final)
    if data.pi is None:
        torque = allowed(data).torque if items else 0.0
        items = [found for item in items if (found := bench.within(item, final, torque)) is not None]
    # A generalisation that was fitted as its neutral case is the same drive: such a pair no command separates.
    table = [
        (pair, trial, [_tried(bench, item, trial, False) for item in items]) for pair in pairs for trial in _trials([pair], final)
    ]
    too_little = {id(pair) for pair, _, T in table if max(T, default=0.0) < POLICY.hope * POLICY.told_apart}
    table = [row for row in table if id(row[0]) not in too_little]
    pairs = [pair for pair in pairs if id(pair) not in too_little]
    if pairs:
        names = _named(pairs)
    trials = [trial for _, trial, _ in table]
    rough = np.min([T for *_, T in table], axis=0) if table and items else np.zeros(0)
    best, most = None, -1.0
    for i in np.argsort(rough)[::-1][: POLICY.commands]:
        T = np.inf
        for trial in trials:
            T = min(T, _tried(bench, items[i], trial, True))
            if most >= T:
                break
        if most < T:
            best, most = items[i], T
    if best is None or most < POLICY.told_apart:
        text = "No experiment of the menu within the limits of these records tells {} apart."
        return None, [*notes, say(text, _listed(names))]
    n = len(best.command)
    alike = {name: tuple(e for e in equivalents(name) if e in possible) for name in names}
    alike = {name: others for name, others in alike.items() if others}
    return replace(best.proposal(names, float(n * np.log1p(most / n))), alike=alike), notes


def _named(pairs: Sequence[tuple[str, Replacement]]) -> tuple[str, ...]:
    """The effects of all pairs, of those that act alike on every record the first."""
    names: dict[str, None] = {}
    for name in (name_of(e) for effect, rival in pairs for e in (effect, rival.effect)):
        if not any(other in names for other in equivalents(name)):
            names[name] = None
    return tuple(names)


def _one_of_each_class(pairs: Sequence[tuple[str, Replacement]]) -> list[tuple[str, Replacement]]:
    """The pairs without those whose rival acts as that of a pair before does on every record."""
    kept: dict[tuple[str, frozenset[str]], tuple[str, Replacement]] = {}
    for effect, rival in pairs:
        name = name_of(rival.effect)
        kept.setdefault((effect, frozenset({name, *equivalents(name)})), (effect, rival))
    return list(kept.values())


def at_rest(fit: Fit, data: DataSet) -> tuple[Hypothesis, Vector]:
    """Hypothesis and x for one record that starts at rest."""
    parameters = fit.parameters
    loop = ClosedLoop if fit.predictor.closed else OpenLoop
    hypothesis = Hypothesis(replace(parameters, starts=(0,)), loop(data, fit.predictor.own_angle))
    return hypothesis, fit.x[: len(fit.x) - sum(parameters.starts)]


def menu(data: DataSet, fit: Fit) -> list[MenuItem]:
    """The menu within the limits that the records show, for the mechanism that was found."""
    assert data.controller is not None
    inertia = inertia_of(fit)
    try:
        limits = allowed(data)
        items = candidate_commands(data.dt, limits, inertia, data.controller.gains.kp or None)
    except GaidentError:
        return []  # nothing moves, or nothing may
    if data.controller.driven_by == "position_command":
        return [item.along_a_path(POLICY.ramp_torque * limits.torque / inertia) for item in items]
    return items


def allowed(data: DataSet) -> Limits:
    """What the records show to be allowed; a torque limit of the controller counts before their highest torque."""
    limits = Limits.of(data.driven if data.pi is None else data.records, data.pi, data.axis)
    most = data.controller.limits[0] if data.controller is not None else np.inf
    torque = most if np.isfinite(most) else limits.torque
    return replace(limits, torque=torque, duration=max(limits.duration, POLICY.proposed_samples * data.dt))


def inertia_of(fit: Fit) -> float:
    """Total inertia [kg m^2]: 1/J = K for one mass, K f0/e0 for two."""
    return float(fit.parameters.inertias(fit.x[None, :])[0])


def _trials(pairs: Sequence[tuple[str, Replacement]], final: Fit) -> list[tuple[Fit, Fit]]:
    """(what is simulated, what is fitted) of every pair and direction that can fail."""
    trials = []
    for effect, rival in pairs:
        if effect not in LIBRARY[rival.effect].nested:
            trials.append((final, rival.fit))
        if rival.effect not in LIBRARY[effect].nested:
            trials.append((rival.fit, final))
    return trials


def _tried(bench: _Bench, item: MenuItem, trial: tuple[Fit, Fit], refitted: bool) -> float:
    record = bench.record(trial[0], item)
    return 0.0 if record is None else bench.left(record, trial[1], refitted)
