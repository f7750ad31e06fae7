"""The cases that show a row of the policy: what each kind of them contains, how one is run, and what its result is called.

    drives      simulated drives of the blind bench, of each number five: one that hides nothing, one effect at its typical size,
                one at 0.1 to 4 times of it, two effects, one that the library does not know
    short       the same with nothing or one effect hidden, cut to 80, 200 or 400 samples
    loop        what only the controller shows: saturation, clamp, rate limit, outliers; two clean records at once, with the gains
                of the loop and with others
    slower      logs with a line for every fourth sample of the controller: its form (rows/slower.py), and drives in such loops
    shifted     clean drives whose log wrote the torque 0, 1 or 2 samples late, with and without a controller
    real        measured drives, diagnosed (GAIDENT_DATA)
    regression  the same records, `ga.inverse_dynamics` alone
    success     linear plants of bench/success.py, `ga.identify`
    winding     currents of motors from weak to strong inductance, `ga.estimate_winding`
    forms       servo controllers of another form than the bare PI that is given, the form's search alone (rows/forms.py)
    logs        clocks, counters, units and stamps of logs, read (rows/logs.py)
    encoder     velocities on the lattices of encoders, and beside them: the lines of a turn (rows/encoders.py)
    periods     logs with a line for every 1 to 16 samples of a controller, whose sample time nobody gave (rows/periods.py)
    profiles    position commands that are straight or smooth between the lines of a slow log (rows/profiles.py)
    ahead       logs whose torque goes on between the lines, by a controller that is not given (rows/slow_torques.py)
    sampled     measured torques in lines of 1 to 10 ms, sampled or held (rows/slow_torques.py)
    short_moves effects outside the library in a single step or move, which hardly tells effects apart (rows/short_moves.py)
    lags        measured torques behind a lag, behind other gains, or only written late (rows/lags.py)
    proposals   experiments that are proposed, run on the axis that they are for (rows/proposals.py)
    unlogged    logs without a torque, of a controller with a filter that the given one has not (rows/unlogged.py)
    responses   frequency responses that a record shows by itself (rows/responses.py)
    instruments frequency responses of a record as data of an identification, under commands of many kinds (rows/instruments.py)
    headers     names of columns, commas and letters of text logs (rows/headers.py)
    numbers     controllers with numbers that nobody gave (rows/numbers.py)
    courses     parameters of an axis over months: steps, drifts, temperature, nothing (rows.made.courses.py)
    pitches     linear axes whose force returns with a length that nobody gave (rows/pitches.py)
    retuned     gains that are proposed for random drives, on the true ones (rows.made.retuned.py)

A result has three parts: an outcome, what is said (verdict and findings; the structure; the terms), and a digest of the rest that
a user reads: parameters to three digits, notes, comparisons, the next experiment.

    right        the truth and nothing else; of an effect outside the library, that something is unexplained
    in set       the truth among alternatives that are said not to be told apart; of one outside, a true part of it
    missed       part of the truth is in no finding
    wrong        a name that is not there
    false alarm  something is said of a record that hides nothing
    refused      an error that says what is missing
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace

import blind
import numpy as np
import success
from rows.case import Case, Result, digest
from rows.encoders import encoders, lines_shown
from rows.forms import forms, shown
from rows.headers import header_read, headers
from rows.instruments import instruments, shown_response
from rows.lags import lag_found, lags
from rows.logs import logs, read_log
from rows.made.courses import change_found, courses
from rows.made.retuned import gains_kept, retuned
from rows.numbers import found_numbers, numbers
from rows.periods import period_taken, periods
from rows.pitches import pitch_seen, pitches
from rows.profiles import interpolated, profiles
from rows.proposals import kept, proposals
from rows.responses import responses, shown_points
from rows.short_moves import described, short_moves
from rows.slow_torques import ahead, measured_torques, named_ahead, named_sampled
from rows.slower import EVERY, shown_slower, slower_forms
from rows.unlogged import form_found, unlogged
from scipy.linalg import expm

import gaident as ga
from blind_judge import judge
from drive_rig import OUTSIDE

LOOP = ("torque_saturation", "integrator_clamp", "command_rate_limit", "outliers")
SLOW_LOOPS = ("bare", "position", "together")
GIVEN = (1.0, 0.9)  # gains that are given, of those of the loop
LENGTHS = (80, 200, 400)  # samples of a short record
STRIDE = 7  # has no divisor in common with the count of effects: neighbours in their list are of one family
OUTCOMES = ("right", "in set", "missed", "wrong", "false alarm", "refused", "crash")


def cases(kind: str, count: int, seed: int) -> list[Case]:
    """The cases of a kind, `count` of each combination, balanced also where only the first ones are run."""
    return [replace(c, key=f"{kind}/{c.key}") for c in KINDS[kind][0](count, seed)]


def run(case: Case) -> Result:
    """The result of one case under the policy of this process."""
    try:
        return KINDS[case.kind][1](case)
    except ga.GaidentError as refusal:
        return Result("refused", type(refusal).__name__, digest(str(refusal)))


def _cells(groups: tuple[str, ...], count: int, seed: int) -> Iterator[blind.Cell]:
    for n in range(count):
        for group in groups:
            found = [c for c in blind.cells(group, n + 1, seed) if c.seed == seed * 1_000_000 + n]
            multi = [c for c in found if c.kind == "multi"] if n % 3 < 2 else found  # single steps show little
            yield multi[(STRIDE * n + zlib.crc32(group.encode())) % len(multi)]


def drives(count: int, seed: int) -> list[Case]:
    groups = ("clean", "effects", "sizes", "pairs", "outside")
    return [Case("drives", c.key, c) for c in _cells(groups, count, seed)]


def short(count: int, seed: int) -> list[Case]:
    cells = [replace(c, kind="multi") for c in _cells(("clean", "effects"), count, seed)]
    return [Case("short", f"{c.key}/{n}", c, n) for c in cells for n in LENGTHS]


def loop(count: int, seed: int) -> list[Case]:
    found = [c for c in blind.cells("effects", count, seed) if c.kind == "multi" and c.effects[0] in LOOP]
    found += [replace(c, kind="multi", torque=True) for c in _cells(("clean",), count, seed)]
    found = [replace(c, torque=True) for c in sorted(found, key=lambda c: c.seed)]
    return [Case("loop", c.key if given == 1.0 else f"{c.key}/{given:g} of the gains", (c, given))
            for c in found for given in (GIVEN[:1] if c.effects else GIVEN)]  # fmt: skip


def slower(count: int, seed: int) -> list[Case]:
    cells = [c for n in range(count) for c in blind.loop_cells(seed * 1_000_000 + n, "loops")]
    return slower_forms(count, seed) + [Case("slower", c.key, c) for c in cells if c.every == EVERY and c.loop in SLOW_LOOPS]


def shifted(count: int, seed: int) -> list[Case]:
    cells = [replace(c, kind="multi", torque=True) for c in _cells(("clean",), count, seed)]
    return [Case("shifted", f"{c.key}/{'PI' if closed else 'open'}/{k}", (c, closed), k)
            for c in cells for closed in (True, False) for k in (0, 1, 2)]  # fmt: skip


def diagnosed(case: Case) -> Result:
    """A cell of the blind bench, whole or cut."""
    cell: blind.Cell = case.what
    try:
        record, validation, controller, truth = blind.case_of(cell)
    except RuntimeError as none:  # this effect does not act there
        return Result("refused", "impossible", digest(str(none)))
    if case.number:
        record, validation = record[: case.number], None
    dia = ga.diagnose(record, controller=controller, validation=validation)
    return Result(outcome(dia, truth.effects), *texts(dia))


def looped(case: Case) -> Result:
    """A cell with an effect as it is; a clean one as two records of one drive, also with other gains than the loop has."""
    cell, given = case.what
    if cell.effects:
        return diagnosed(replace(case, what=cell))
    record, validation, controller, truth = blind.case_of(cell)
    assert validation is not None and isinstance(controller, ga.PI)
    dia = ga.diagnose([record, validation], controller=replace(controller, kp=given * controller.kp, ki=given * controller.ki))
    return Result(outcome(dia, truth.effects), *texts(dia))


def outcome(dia: ga.Diagnosis, effects: dict[str, dict[str, float]]) -> str:
    judged = judge(dia, effects)
    if not effects:
        return "right" if dia.verdict == "adequate" and not judged.sets else "false alarm"
    if judged.wrong:
        return "wrong"
    if set(effects) & set(OUTSIDE):
        known = "wrong" if judged.extra else "in set"  # explained by what is not there, or by a true part of it
        return {"adequate": "missed", "explained": known}.get(dia.verdict, "right")
    return "right" if judged.exact else "in set" if judged.in_set else "missed"


def texts(dia: ga.Diagnosis) -> tuple[str, str]:
    """What a diagnosis says, and a digest of the rest."""
    sets = [" or ".join([f.effect, *f.alternatives]) for f in dia.findings]
    said = f"{dia.verdict}: {', '.join(sets)}; {dia.driver}"
    parameters = {f"{f.effect}.{name}": f"{e.value:.3g}" for f in dia.findings for name, e in f.parameters.items()}
    proposal = dia.next_experiment
    rest = [parameters, dia.notes, sorted(dia.not_testable), sorted(dia.one_sided), dia.held_out, f"{dia.after.rmse:.3g}"]
    rest += [[(c.name, c.differs) for c in dia.comparisons], proposal and [proposal.separates, proposal.reason], dia.force_reason]
    return said, digest(rest)


def moved(case: Case) -> Result:
    (cell, closed), late = case.what, case.number
    record, _, controller, _ = blind.case_of(cell)
    record = record.shifted(torque=late) if late else record
    dia = ga.diagnose(record, controller=controller if closed else None)
    back = dia.log_shifts.get(record.digest, {})
    expected = {"torque": -late} if late else {}
    said, rest = texts(dia)
    called = "right" if back == expected else "missed" if not back else "wrong" if late else "false alarm"
    return Result(called, f"{said}; moved {dict(back)}", rest)


def real(count: int, seed: int) -> list[Case]:
    from real_records import DRIVES
    from real_records import Case as Measured

    return [Case("real", f"{name}/{variation}", Measured(name, variation))
            for n in range(count) for name, row in DRIVES.items() for variation in row.variations[n : n + 1]]  # fmt: skip


def diagnosed_real(case: Case) -> Result:
    from real_judge import judge as judge_real
    from real_judge import said
    from real_records import parts_of

    training = parts_of(case.what).training
    dia = ga.diagnose(training if len(training) > 1 else training[0], controller=case.what.row.controller)
    return Result(judge_real(case.what.row, said(dia))["outcome"], *texts(dia))


def regressed(case: Case) -> Result:
    from real_records import FRICTION, GRAVITY, parts_of

    parts, row = parts_of(case.what), case.what.row
    found = ga.inverse_dynamics(parts.training, validation=parts.held_out, axis=row.axis)
    terms = {FRICTION: any("coulomb" in t for t in found.terms), GRAVITY: "gravity" in found.terms}
    called = "right" if all(terms.get(group, True) for group in row.truth or ()) else "missed"
    values = {name: f"{e.value:.3g}" for name, e in found.parameters.items()}
    return Result(called, " + ".join(found.terms), digest([values, sorted(found.not_tried), f"{found.force_error_held_out:.3g}"]))


def plants(count: int, seed: int) -> list[Case]:
    return [Case("success", f"{name}/{seed}/{n}", name, n + 1000 * seed) for n in range(count) for name in success.CASES]


def identified(case: Case) -> Result:
    """As bench/success.py judges it: the true structure, and a response that is as good as noise permits."""
    make, _ = success.CASES[case.what]
    rng = np.random.default_rng([case.number, len(case.what)])
    drawn = success.bounded_loop(make, rng)
    truth = success.noise_free(drawn)
    rec = ga.Record(dt=success.DT, command=drawn.command, velocity=truth + drawn.noise * rng.standard_normal(len(truth)))
    idn = ga.identify(rec, drawn.controller, seed=1000 + case.number, workers=1)
    deviation = float(np.sqrt(np.mean((idn.simulate(rec) - truth) ** 2)) / drawn.noise)
    good = (idn.p, idn.q) == (drawn.model.p, drawn.model.q) and deviation < drawn.limit
    rest = [idn.warnings, [(s.p, s.q) for s in idn.structures], [(r.p, r.q) for r in idn.rivals], f"{idn.rmse:.3g}"]
    return Result("right" if good else "wrong", f"({idn.p}, {idn.q}), falsified {idn.falsified}", digest(rest))


def windings(count: int, seed: int) -> list[Case]:
    return [Case("winding", f"{seed}/{n}/{L:g} H", L, n + 1000 * seed)
            for n in range(count) for L in (0.0, 3e-5, 1e-4, 3e-4, 1e-3)]  # fmt: skip


def wound(case: Case) -> Result:
    """U = R i + L di/dt + ke w and J dw/dt = kt i - D w, U held over each sample, 3000 of 1 ms; noise of 0.05 A and 0.05 rad/s.

    An inductance that is shown is right within a tenth.
    """
    rng, R, L, ke, J, D, dt = np.random.default_rng(case.number), 0.8, float(case.what), 0.06, 2e-4, 4e-4, 1e-3
    U = np.repeat(rng.uniform(-20.0, 20.0, 40), 75)
    lag = max(L, 1e-9)  # of a thousandth of a thousandth of a sample where there is none
    step = expm(dt * np.array([[-R / lag, -ke / lag, 1.0 / lag], [ke / J, -D / J, 0.0], [0.0, 0.0, 0.0]]))
    log, state = np.empty((2, len(U))), np.zeros(3)
    for n, u in enumerate(U):
        state[2] = u
        log[:, n] = state[:2] if L else ((u - ke * state[1]) / R, state[1])
        state = step @ state
    current, velocity = log + 0.05 * rng.standard_normal(log.shape)
    found = ga.estimate_winding(U, current, velocity, dt)
    shown = found.winding.inductance
    called = "right" if abs(shown - L) <= 0.1 * L else "false alarm" if not L else "wrong" if shown else "missed"
    first = found.winding.current(U, velocity, dt)[0]
    rest = [*(f"{e.value:.3g}" for e in found.parameters.values()), f"{first:.3g}"]
    return Result(called, "inductance" if shown else "none", digest(rest))


KINDS: dict[str, tuple[Callable[[int, int], list[Case]], Callable[[Case], Result]]] = {
    "drives": (drives, diagnosed),
    "short": (short, diagnosed),
    "loop": (loop, looped),
    "slower": (slower, lambda case: diagnosed(case) if isinstance(case.what, blind.Cell) else shown_slower(case)),
    "shifted": (shifted, moved),
    "real": (real, diagnosed_real),
    "regression": (lambda count, seed: [replace(c, kind="regression") for c in real(count, seed)], regressed),
    "success": (plants, identified),
    "winding": (windings, wound),
    "forms": (forms, shown),
    "logs": (logs, read_log),
    "encoder": (encoders, lines_shown),
    "periods": (periods, period_taken),
    "profiles": (profiles, interpolated),
    "ahead": (ahead, named_ahead),
    "sampled": (measured_torques, named_sampled),
    "short_moves": (short_moves, described),
    "lags": (lags, lag_found),
    "proposals": (proposals, kept),
    "unlogged": (unlogged, form_found),
    "responses": (responses, shown_points),
    "instruments": (instruments, shown_response),
    "headers": (headers, header_read),
    "pitches": (pitches, pitch_seen),
    "courses": (courses, change_found),
    "numbers": (numbers, found_numbers),
    "retuned": (retuned, gains_kept),
}
"""Kind -> what makes its cases (count, seed), and what runs one."""
