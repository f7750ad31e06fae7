"""identify(): structure and parameters recovered, honest about what it cannot know, the same for any workers and order."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.errors import RecordError, SettingsError, SpaceError

DT = 0.444e-3
TWO_MASS = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model()
ONE_MASS = ga.OneMass(J=1.59e-4, D=0.0054).model()
LOOPS = ("continuous", "sampled", "open")


def controller(loop: str, scale: float = 5.0) -> ga.PI | None:
    return None if loop == "open" else ga.PI(0.0232 * scale, 1.367 * scale, loop=loop)


def record(
    model: ga.Model,
    loop: str,
    seed: int = 0,
    noise: float = 0.1,
    samples: int = 600,
    initial_state: np.ndarray | None = None,
) -> ga.Record:
    rng = np.random.default_rng(seed)
    stairs = np.repeat(rng.uniform(-40.0, 40.0, 6), -(-samples // 6))[:samples]
    channel = "torque" if loop == "open" else "command"
    source = stairs * 0.02 if loop == "open" else stairs
    blank = ga.Record(dt=DT, velocity=np.zeros(samples), **{channel: source})
    w = ga.simulate(model, blank, controller(loop), initial_state)
    return ga.Record(dt=DT, velocity=w + noise * rng.standard_normal(samples), name=f"{loop} {seed}", **{channel: source})


def within(estimate: ga.Estimate, truth: float, sigmas: float = 5.0) -> bool:
    return abs(estimate.value - truth) < sigmas * estimate.std


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize(("model", "structure"), [(ONE_MASS, (1, 0)), (TWO_MASS, (1, 2))])
def test_structure_and_parameters_are_recovered(loop: str, model: ga.Model, structure: tuple[int, int]) -> None:
    idn = ga.identify(record(model, loop), controller(loop), workers=1)
    assert (idn.p, idn.q) == structure
    assert within(idn.parameters["gain"], model.gain)
    assert idn.parameters["gain"].std < 0.2 * model.gain
    assert idn.rmse == pytest.approx(0.1, rel=0.1)
    assert not idn.falsified
    assert idn.mechanics is not None and idn.mechanics.physical


def test_mechanics_are_recovered_within_their_standard_deviations() -> None:
    idn = ga.identify(record(TWO_MASS, "sampled", noise=0.05, samples=2000), controller("sampled"), workers=1)
    truth = {"JM": 1.02e-4, "DM": 0.003, "JL": 5.815e-4, "DL": 0.008, "KG": 2.59}
    assert isinstance(idn.mechanics, ga.TwoMass)
    for name, value in truth.items():
        assert abs(getattr(idn.mechanics, name) - value) < 5.0 * idn.mechanics.std[name], name
        assert idn.mechanics.std[name] < 0.5 * value, name


@pytest.mark.long
@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_standard_deviations_are_calibrated(colour: float) -> None:
    """z-scores of 40 noise draws, white and coloured: their rms is 1 within what 40 draws tell."""
    ctl = controller("continuous")
    quiet = record(TWO_MASS, "continuous", noise=0.0)
    z: dict[str, list[float]] = {"gain": [], "pole_1": [], "pole_pair_1_imaginary": [], "zero_pair_1_imaginary": []}
    truth = {
        "gain": TWO_MASS.gain,
        "pole_1": next(p.real for p in TWO_MASS.poles if p.imag == 0.0),
        "pole_pair_1_imaginary": max(p.imag for p in TWO_MASS.poles),
        "zero_pair_1_imaginary": max(p.imag for p in TWO_MASS.zeros),
    }
    for seed in range(40):
        white = np.random.default_rng(seed).standard_normal(len(quiet))
        e = np.empty_like(white)
        past = 0.0
        for n, v in enumerate(white):
            past = e[n] = v + colour * past
        rec = ga.Record(dt=DT, command=quiet.command, velocity=quiet.velocity + 0.1 * e)
        idn = ga.identify(rec, ctl, workers=1, seed=seed)
        assert (idn.p, idn.q) == (1, 2)
        assert not idn.falsified, "coloured noise alone must not falsify the model"
        for name, values in z.items():
            values.append((idn.parameters[name].value - truth[name]) / idn.parameters[name].std)
    for name, values in z.items():
        assert 0.65 < math.sqrt(float(np.mean(np.square(values)))) < 1.5, name


def test_several_records_share_one_model_whatever_their_order_and_the_workers() -> None:
    ctl = controller("sampled")
    records = [record(TWO_MASS, "sampled", seed=s, samples=400) for s in range(3)]
    first = ga.identify(records, ctl, seed=3, workers=1)
    for other in (
        ga.identify(records[::-1], ctl, seed=3, workers=2),
        ga.identify([records[1], records[2], records[0]], ctl, seed=3, workers=5),
    ):
        assert other.model == first.model
        assert other.parameters == first.parameters
        assert other.history == first.history
        assert other.structures == first.structures
    assert (first.p, first.q) == (1, 2)


def test_the_seed_alone_decides() -> None:
    rec, ctl = record(TWO_MASS, "continuous"), controller("continuous")
    settings = ga.Settings(generations=30, engine="plain")
    runs = [ga.identify(rec, ctl, settings=settings, trials=4, seed=s, workers=w) for s, w in ((7, 1), (7, 2), (8, 1))]
    assert runs[0].trials == runs[1].trials
    assert runs[0].trials != runs[2].trials


@pytest.mark.parametrize("loop", ["sampled", "open"])
def test_a_record_that_starts_in_motion_gets_its_initial_state(loop: str) -> None:
    ctl = controller(loop)
    long = record(TWO_MASS, loop, noise=0.05, samples=1500)
    moving = long[317:]
    assert abs(moving.velocity[0]) > 1.0
    idn = ga.identify(moving, ctl, workers=1)
    assert (idn.p, idn.q) == (1, 2)
    assert idn.rmse == pytest.approx(0.05, rel=0.1)
    assert list(idn.initial_states) == [moving.digest]
    assert np.sqrt(np.mean(idn.residual(moving) ** 2)) == pytest.approx(idn.rmse)
    later = long[700:]  # a record the identification has not seen
    assert np.sqrt(np.mean(idn.residual(later) ** 2)) == pytest.approx(0.05, rel=0.2)


def test_moving_and_resting_records_together() -> None:
    ctl = controller("sampled")
    long = record(TWO_MASS, "sampled", noise=0.05, samples=1200)
    idn = ga.identify([record(TWO_MASS, "sampled", seed=5, noise=0.05), long[400:]], ctl, workers=2)
    assert (idn.p, idn.q) == (1, 2)
    assert idn.rmse == pytest.approx(0.05, rel=0.1)
    assert len(idn.initial_states) == 1


def test_limits_of_the_controller_are_part_of_the_loop() -> None:
    ctl = ga.PI(0.116, 6.8, torque_limit=0.8, integrator_limit=0.6)
    rng = np.random.default_rng(2)
    command = np.repeat(rng.uniform(-40.0, 40.0, 6), 200)
    blank = ga.Record(dt=DT, command=command, velocity=np.zeros(1200))
    run = ga.run(TWO_MASS, blank, ctl)
    assert np.mean(np.abs(run.torque) >= 0.8) > 0.02, "the limit must act for this test to mean anything"
    rec = ga.Record(dt=DT, command=command, velocity=run.velocity + 0.05 * rng.standard_normal(1200))
    idn = ga.identify(rec, ctl, workers=1)
    assert (idn.p, idn.q) == (1, 2)
    assert within(idn.parameters["gain"], TWO_MASS.gain)
    unlimited = ga.identify(rec, ga.PI(0.116, 6.8), workers=1)
    assert unlimited.rmse > 2.0 * idn.rmse, "without the known limits the fit must suffer"


def coulomb_drive(loop_gain: float = 0.02, samples: int = 1500, friction: float = 0.03) -> tuple[ga.Record, ga.PI]:
    """One mass with dry friction under a digital PI, by 50 explicit substeps per sample with an exact stop: none of our code."""
    ctl = ga.PI(loop_gain, 0.4)
    inertia, viscous, substeps = 2e-4, 1e-3, 50
    rng = np.random.default_rng(4)
    command = np.repeat(rng.uniform(-30.0, 30.0, 10), samples // 10)
    w, integral, last = 0.0, 0.0, 0.0
    velocity = np.empty(samples)
    h = DT / substeps
    for n in range(samples):
        velocity[n] = w
        e = command[n] - w
        integral += ctl.ki * DT * (e + last) / 2.0
        last = e
        u = ctl.kp * e + integral
        for _ in range(substeps):
            free = w + h * (u - viscous * w) / inertia
            drop = h * friction / inertia
            w = math.copysign(max(abs(free) - drop, 0.0), free)
    return ga.Record(dt=DT, command=command, velocity=velocity + 0.02 * rng.standard_normal(samples)), ctl


def test_dry_friction_falsifies_the_linear_model() -> None:
    rec, ctl = coulomb_drive()
    idn = ga.identify(rec, ctl, workers=1)
    assert idn.falsified
    assert idn.adequacy.independence_p < 1e-6
    assert any("falsified" in w for w in idn.warnings)
    assert "falsified" in idn.summary()
    frictionless, ctl = coulomb_drive(friction=0.0)
    assert not ga.identify(frictionless, ctl, workers=1).falsified


def test_search_space_bounds_hold_and_are_flagged() -> None:
    rec, ctl = record(TWO_MASS, "continuous"), controller("continuous")
    space = ga.SearchSpace(gain=(1e3, 8e3), real=(0.0, 60.0), imaginary=(0.0, 250.0), p=(1, 1), q=(2, 2))
    idn = ga.identify(rec, ctl, space=space, workers=1)
    assert idn.space == space
    assert idn.model.gain <= 8e3 * (1 + 1e-9)
    assert idn.parameters["gain"].at_bound
    assert math.isnan(idn.parameters["gain"].std)
    assert any("bound" in w for w in idn.warnings)


def test_what_the_record_does_not_show_is_not_identifiable() -> None:
    """A second resonance far above everything the record excites: forced into the structure, it must be flagged."""
    rec, ctl = record(ONE_MASS, "continuous", noise=0.5, samples=250), controller("continuous")
    space = ga.SearchSpace(gain=(1e3, 2e4), real=(0.0, 500.0), imaginary=(0.0, 2500.0), p=(1, 1), q=(2, 2))
    idn = ga.identify(rec, ctl, space=space, workers=1)
    assert any(not e.identifiable for e in idn.parameters.values())
    assert any("identifiable" in w or "bound" in w for w in idn.warnings)


def test_from_mechanics_ranges_identify_the_drive() -> None:
    space = ga.SearchSpace.from_mechanics(inertia=(1e-4, 2e-3), resonance_hz=(5.0, 100.0))
    idn = ga.identify(record(TWO_MASS, "continuous"), controller("continuous"), space=space, workers=1)
    assert (idn.p, idn.q) == (1, 2)
    assert within(idn.parameters["gain"], TWO_MASS.gain)


def test_paper_settings_are_table_two() -> None:
    s = ga.Settings.paper()
    assert (s.population, s.tournament, s.crossover, s.mutation, s.generations, s.elites) == (50, 2, 0.9, 0.01, 1000, 0)
    assert (s.code, s.scale, s.error_weight, s.order_weight, s.engine) == ("binary", "linear", 1.0, 2.0, "plain")
    rec, ctl = record(ONE_MASS, "continuous", samples=250), controller("continuous", 1.6744)
    idn = ga.identify(rec, ctl, space=ga.SearchSpace(), settings=s, workers=1)
    assert len(idn.history) == 1000
    assert idn.trials[0].evaluations == 50_000
    expected = np.sum(idn.residual(rec) ** 2) + 2.0 * (idn.p + idn.q)
    assert idn.fitness == pytest.approx(expected, rel=1e-9)
    assert min(idn.history) == pytest.approx(expected, rel=1e-6), "the best candidate ever seen is reported"
    codes = 2**10 - 1
    code = math.log(idn.model.gain / 1e3) / math.log(20.0) * codes
    assert code == pytest.approx(round(code), abs=1e-6), "no local fit: the gain is one of its 1024 codes"


def test_float_search_finds_the_same_structure() -> None:
    rec, ctl = record(TWO_MASS, "continuous"), controller("continuous")
    idn = ga.identify(rec, ctl, settings=ga.Settings(arithmetic="float"), workers=1)
    assert (idn.p, idn.q) == (1, 2)
    assert idn.model.gain == pytest.approx(ga.identify(rec, ctl, workers=1).model.gain, rel=1e-5)


def test_rivals_are_within_ten_units_and_not_the_winner() -> None:
    ctl = controller("continuous")
    seen = 0
    for seed in range(6):
        idn = ga.identify(record(TWO_MASS, "continuous", seed=seed, noise=0.5, samples=250), ctl, workers=1, seed=seed)
        assert all((r.p, r.q) != (idn.p, idn.q) and r.delta_bic <= 10.0 for r in idn.rivals)
        seen += len(idn.rivals)
    assert seen > 0


def test_save_and_load(tmp_path: object) -> None:
    from pathlib import Path

    rec, ctl = record(TWO_MASS, "sampled"), controller("sampled")
    idn = ga.identify(rec, ctl, workers=1)
    path = Path(str(tmp_path)) / "result.json"
    idn.save(path)
    again = ga.load(path)
    assert again == idn
    assert np.array_equal(again.simulate(rec), idn.simulate(rec))
    assert [p.name for p in path.parent.iterdir()] == ["result.json"]
    path.write_text(path.read_text()[:300])
    with pytest.raises(ga.GaidentError, match=r"result\.json: line"):
        ga.load(path)
    path.write_text('{"schema": "something else"}')
    with pytest.raises(ga.GaidentError, match="contains no saved identification, diagnosis, retuning or record"):
        ga.load(path)
    with pytest.raises(ga.GaidentError, match="nowhere"):
        ga.load(path.parent / "nowhere.json")


def test_progress_is_reported_and_an_error_in_it_stops_the_run() -> None:
    rec, ctl = record(TWO_MASS, "continuous"), controller("continuous")
    seen: list[float] = []
    settings = ga.Settings(engine="plain", generations=20_000)
    ga.identify(rec, ctl, settings=settings, workers=1, progress=lambda f, text: seen.append(f))
    assert seen and all(0.0 <= f <= 1.0 for f in seen) and seen == sorted(seen)

    def broken(fraction: float, text: str) -> None:
        raise RuntimeError("no more")

    began = time.perf_counter()
    with pytest.raises(RuntimeError, match="no more"):
        ga.identify(rec, ctl, settings=ga.Settings(engine="plain", generations=5_000_000), progress=broken)
    assert time.perf_counter() - began < 20.0  # it would take minutes


MISUSE = [
    (lambda r, c: ga.identify([], c), RecordError, "rec is list"),
    (lambda r, c: ga.identify(3, c), RecordError, "rec is int"),
    (lambda r, c: ga.identify(r), RecordError, "no torque"),
    (lambda r, c: ga.identify(r, "PI"), SettingsError, "controller"),
    (lambda r, c: ga.identify(r, c, trials=0), SettingsError, "trials is 0"),
    (lambda r, c: ga.identify(r, c, seed=-1), SettingsError, "seed is -1"),
    (lambda r, c: ga.identify(r, c, workers=0), SettingsError, "workers is 0"),
    (lambda r, c: ga.identify(r, c, space=(1, 2)), SpaceError, "space"),
    (lambda r, c: ga.identify(r, c, settings={"population": 3}), SettingsError, "settings"),
    (lambda r, c: ga.SearchSpace(gain=(0.0, 1.0)), SpaceError, "gain"),
    (lambda r, c: ga.SearchSpace(real=(5.0, 1.0)), SpaceError, "real"),
    (lambda r, c: ga.SearchSpace(imaginary=(-5.0, 1.0)), SpaceError, "imaginary"),
    (lambda r, c: ga.SearchSpace(p=(0, 8)), SpaceError, "p is"),
    (lambda r, c: ga.SearchSpace(bits=1), SpaceError, "bits"),
    (lambda r, c: ga.SearchSpace.from_mechanics(inertia=(0.0, 1.0), resonance_hz=(1, 2)), SpaceError, "inertia"),
    (lambda r, c: ga.Settings(population=1), SettingsError, "population is 1"),
    (lambda r, c: ga.Settings(crossover=1.5), SettingsError, "crossover"),
    (lambda r, c: ga.Settings(engine="swarm"), SettingsError, "engine"),
    (lambda r, c: ga.Settings(arithmetic="half"), SettingsError, "arithmetic"),
]


@pytest.mark.parametrize(("call", "error", "text"), MISUSE)
def test_wrong_use_names_argument_and_value(call: object, error: type[Exception], text: str) -> None:
    assert callable(call)
    with pytest.raises(error, match=text.replace("(", r"\(")):
        call(record(ONE_MASS, "continuous"), controller("continuous"))


def test_a_record_in_which_nothing_moves_is_refused_with_a_remedy() -> None:
    still = ga.Record(dt=DT, command=np.zeros(100), velocity=np.zeros(100))
    with pytest.raises(SpaceError, match="constant"):
        ga.identify(still, controller("sampled"))
    reversed_sign = record(ONE_MASS, "open")
    with pytest.raises(SpaceError, match="reverse the sign"):
        ga.identify(ga.Record(dt=DT, torque=reversed_sign.torque, velocity=-reversed_sign.velocity))


def test_a_constant_command_is_taken_as_a_step_from_rest_and_doubted() -> None:
    """A step record of another loop: its first velocity is not 0, but an unknown start would leave zeros and gain open."""
    rec = record(TWO_MASS, "continuous", noise=0.3, samples=250)
    step = ga.Record(dt=DT, command=np.full(250, 43.6), velocity=np.zeros(250))
    w = ga.simulate(TWO_MASS, step, controller("continuous"))
    rec = ga.Record(dt=DT, command=step.command, velocity=w + 0.05 * np.random.default_rng(0).standard_normal(250), name="step")
    assert abs(rec.velocity[0]) > 1.0
    idn = ga.identify(rec, controller("sampled"), workers=1)
    assert not idn.initial_states
    assert any("step from rest" in w for w in idn.warnings)
    assert not any("step from rest" in w for w in ga.identify(rec, controller("continuous"), workers=1).warnings)


def test_numbers_beyond_reason_are_refused_before_the_core() -> None:
    rec, ctl = record(ONE_MASS, "continuous"), controller("continuous")
    for arguments in ({"trials": 10**14}, {"workers": 10**9}, {"seed": 2**70}):
        with pytest.raises(SettingsError, match=next(iter(arguments))):
            ga.identify(rec, ctl, **arguments)


def test_rounds_go_on_only_for_better_optima() -> None:
    """A model without the friction stays far above the noise; still the second round, which finds nothing new, is the last."""
    model, loop = ONE_MASS.with_effect("coulomb_friction", torque=1.0), controller("sampled")
    rec = record(ONE_MASS, "sampled")
    w = ga.simulate(model, rec, loop)
    rubbing = ga.Record(DT, rec.command, w + 0.1 * np.random.default_rng(0).standard_normal(len(w)))
    idn = ga.identify(rubbing, loop, workers=1)
    assert idn.rmse > 1.0
    assert idn.trials[0].generations == 2 * ga.Settings().round
    assert ga.identify(rec, loop, workers=1).trials[0].generations == ga.Settings().round


def test_a_structure_far_behind_the_best_has_no_rivals_within_reach() -> None:
    """One mass behind a current loop: the smallest mechanism is reported, and the note says why, and what to do next."""
    skip_without_library()
    dt, levels = 0.25e-3, np.repeat(np.random.default_rng(3).uniform(-70.0, 70.0, 14), 250)
    plant, lag = Plant(J=1.5e-3, D=0.004, kp=0.45, ki=20.0, dt=dt), {"torque_lag": {"time_constant": 0.4e-3}}
    encoder = Noise(white=0.0, encoder=2.0 * np.pi / 2**20, differenced=True)
    idn = ga.identify(rig(plant, levels, lag, encoder, seed=3), ga.PI(0.45, 20.0))
    assert idn.p == 1 and idn.rivals == ()
    assert any("Larger structures come closer" in note and "A diagnosis looks for" in note for note in idn.warnings)
    assert not any("the smallest is reported" in note for note in idn.warnings)
