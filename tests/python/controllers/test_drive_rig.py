"""The simulated drive of the blind tests against itself, closed forms and SciPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from drive_cases import (
    EFFECTS,
    KINDS,
    NOISE_EFFECTS,
    comes_to_rest,
    draw_effect,
    nominal_plants,
    random_case,
    random_plant,
    random_truth,
    two_masses,
)
from drive_rig import (
    AT_LOAD,
    COUPLING,
    NOISES,
    OUTSIDE,
    SHAFT,
    Array,
    Effects,
    Plant,
    RanAwayError,
    drive_values,
    fields,
    rig,
    run_drive,
    skip_without_library,
)
from fine_integrator import FineCase, integrate

skip_without_library()

ONE = Plant(J=3e-4, D=2e-3, kp=0.03, ki=1.9, dt=1e-3)
TWO = Plant(J=2e-4, D=1e-3, JL=3e-4, DL=2e-3, KG=20.0, DG=1e-3, kp=0.03, ki=1.5, dt=0.5e-3)


def levels(plant: Plant, samples: int = 50) -> Array:
    return np.repeat([0.0, 20.0, -20.0, 4.0, -1.0, 60.0, 0.0, -3.0], samples)


def linear(
    plant: Plant, command: Array, delay: float = 0.0, lag: float = 0.0, filter_: float = 0.0, extra: tuple[float, ...] = ()
) -> Array:
    """The sampled loop with a linear drive by matrix exponentials: states w, w2, twist, lag, filter, e1, e2, input u."""
    a = np.zeros((8, 8))
    wp, zp, wz, zz = extra or (1.0, 0.0, 1.0, 0.0)
    g = (wp / wz) ** 2
    source = np.eye(8)[3 if lag else 7]
    behind = g * source + g * (wz**2 - wp**2) * np.eye(8)[5] + 2 * g * (zz * wz - zp * wp) * np.eye(8)[6]
    spring = np.zeros(8)
    if plant.two_masses:
        spring[[0, 1, 2]] = plant.DG, -plant.DG, plant.KG
        a[1] = spring / plant.JL
        a[1, 1] -= plant.DL / plant.JL
        a[2, :2] = 1, -1
    a[0] = (behind - spring) / plant.J
    a[0, 0] -= plant.D / plant.J
    if lag:
        a[3, [3, 7]] = -1 / lag, 1 / lag
    if filter_:
        a[4, [0, 4]] = 1 / filter_, -1 / filter_
    a[5, 6] = 1
    a[6] = source - 2 * zp * wp * np.eye(8)[6] - wp**2 * np.eye(8)[5]
    whole = int(delay / plant.dt + 1e-9)
    part = delay - whole * plant.dt
    first, second = expm(a * part), expm(a * (plant.dt - part))
    x, integral, last, past = np.zeros(8), 0.0, 0.0, [0.0] * (whole + 2)
    out = np.empty(len(command))
    for n, r in enumerate(command):
        out[n] = x[4] if filter_ else x[0]
        error = r - out[n]
        integral += plant.ki * plant.dt / 2 * (error + last)
        last = error
        past = [plant.kp * error + integral, *past[:-1]]
        x[7] = past[whole + 1]
        x = first @ x
        x[7] = past[whole]
        x = second @ x
    return out


@pytest.mark.parametrize("plant", [ONE, TWO], ids=["one mass", "two masses"])
@pytest.mark.parametrize(
    ("effects", "options"),
    [
        ({}, {}),
        ({"transport_delay": {"delay": 1e-3}}, {"delay": 1e-3}),
        ({"transport_delay": {"delay": 1.3e-3}}, {"delay": 1.3e-3}),
        ({"torque_lag": {"time_constant": 0.8e-3}}, {"lag": 0.8e-3}),
        ({"velocity_filter": {"time_constant": 0.8e-3}}, {"filter_": 0.8e-3}),
        (
            {"extra_resonance": {"frequency": 1100.0, "damping": 0.02, "zero_frequency": 1000.0, "zero_damping": 0.03}},
            {"extra": (1100.0, 0.02, 1000.0, 0.03)},
        ),
    ],
    ids=["none", "delay", "fraction", "lag", "filter", "resonance"],
)
def test_linear_drives_agree_with_matrix_exponentials(plant: Plant, effects: Effects, options: dict[str, float]) -> None:
    command = levels(plant)
    exact = linear(plant, command, **options)  # type: ignore[arg-type]
    assert np.ptp(exact) > 50
    assert np.abs(run_drive(plant, command, effects).velocity - exact).max() < 2e-5


def test_friction_stops_the_shaft_and_holds_it() -> None:
    """J dw/dt = T - D w -+ Tc in closed form: break-away, coasting to rest at the predicted instant, exact rest."""
    push, friction = 0.2, 0.05
    torque = np.concatenate([np.full(100, 0.049), np.full(100, push), np.zeros(200), np.full(50, -0.0499)])
    log = run_drive(ONE, None, {"coulomb_friction": {"torque": friction}}, torque=torque)
    t = np.arange(100) * ONE.dt
    tau, top = ONE.J / ONE.D, (push - friction) / ONE.D
    assert (log.truth[:101] == 0).all()
    assert np.abs(log.truth[100:200] - top * (1 - np.exp(-t / tau))).max() < 1e-8
    at_release = top * (1 - np.exp(-0.1 / tau))
    coasting = (at_release + friction / ONE.D) * np.exp(-np.arange(200) * ONE.dt / tau) - friction / ONE.D
    assert np.abs(log.truth[200:400] - np.maximum(coasting, 0)).max() < 1e-8
    assert coasting.min() < 0 and (log.truth[300 + np.argmax(coasting[100:] < 0) :] == 0).all()
    assert np.ptp(log.position[400:]) == 0


def test_static_friction_breaks_away_at_its_own_level() -> None:
    stribeck = {"stribeck_friction": {"torque": 0.04, "static_torque": 0.07, "stribeck_velocity": 2.0}}
    ramp = np.arange(200) * 5e-4
    moving = np.flatnonzero(run_drive(ONE, None, stribeck, torque=ramp).truth != 0)[0]
    assert ramp[moving - 2] <= 0.07 < ramp[moving - 1]


def smooth_motion(plant: Plant, torque: float, effect: str, f: dict[str, float], t: Array) -> Array:
    """Motor velocity under a constant torque, by SciPy; `f` names what acts."""
    shaft = effect in COUPLING

    def slope(t: float, x: Array) -> list[float]:
        w, theta, w2, twist, z = x
        q, inertia = torque, plant.J
        if "stribeck_velocity" in f:
            q -= np.sign(w) * (f["torque"] + (f["static_torque"] - f["torque"]) * np.exp(-((w / f["stribeck_velocity"]) ** 2)))
        if "torque_positive" in f:
            q -= f["torque_positive"] + f["viscous_positive"] * w if w > 0 else -f["torque_negative"] + f["viscous_negative"] * w
        if "coefficient" in f:
            q -= f["coefficient"] * np.sign(w) * abs(w) ** (0.5 if effect == "square_root_drag" else 2.0)
        if effect == "position_friction":
            q -= f["torque"] * (1 + f["amplitude"] * np.cos(f["order"] * theta + f["phase"])) * np.sign(w)
        elif effect == "torque_hum":
            q += f["amplitude"] * np.sin(2.0 * np.pi * f["frequency"] * t + f["phase"])
        elif effect == "position_inertia":
            psi = f["order"] * theta + f["phase"]
            q += 0.5 * plant.J * f["amplitude"] * f["order"] * np.sin(psi) * w**2
            inertia = plant.J * (1.0 + f["amplitude"] * np.cos(psi))
        elif "amplitude" in f:
            q -= f["amplitude"] * np.sin(f.get("order", 1.0) * theta + f["phase"])
        if "rate" in f:
            q -= f["torque"] * (1 + f["rate"] * t) * np.sign(w)
        bristle = f.get("stiffness", 0.0) * z
        q -= 0.0 if shaft else bristle
        beyond = np.sign(twist) * max(abs(twist) - f.get("gap", 0.0) / 2, 0.0)
        spring = plant.KG * beyond + f.get("cubic_stiffness", 0.0) * beyond**3
        if beyond or not f.get("gap"):
            spring += plant.DG * (w - w2)
        spring += bristle if shaft else 0.0
        rate = w - w2 if shaft else w
        dz = rate - abs(rate) * bristle / f["torque"] if "stiffness" in f else 0.0
        load = ((spring - plant.DL * w2) / plant.JL, w - w2) if plant.two_masses else (0.0, 0.0)
        return [(q - plant.D * w - (spring if plant.two_masses else 0)) / inertia, w, *load, dz]

    start = [np.sign(torque) * 1e-300, 0, 0, 0, 0]
    solution = solve_ivp(slope, (0, t[-1]), start, "LSODA", t, rtol=1e-9, atol=1e-11, max_step=1e-4)
    return np.asarray(solution.y[0])


@pytest.mark.parametrize(
    ("effect", "parameters"),
    [
        ("stribeck_friction", {"torque": 0.04, "static_torque": 0.07, "stribeck_velocity": 2.0}),
        (
            "asymmetric_friction",
            {"torque_positive": 0.06, "torque_negative": 0.03, "viscous_positive": 1e-3, "viscous_negative": 0.0},
        ),
        ("quadratic_drag", {"coefficient": 1.5e-5}),
        ("unbalance", {"amplitude": 0.05, "phase": 0.4}),
        ("cogging", {"amplitude": 0.03, "order": 6.0, "phase": -1.0}),
        ("friction_drift", {"torque": 0.05, "rate": 3.0}),
        ("presliding_friction", {"torque": 0.05, "stiffness": 3.0}),
        ("backlash", {"gap": 0.01}),
        ("hardening_stiffness", {"cubic_stiffness": 2e4}),
        ("hysteretic_coupling", {"torque": 0.02, "stiffness": 6.0}),
        ("square_root_drag", {"coefficient": 6e-3}),
        ("position_friction", {"torque": 0.05, "amplitude": 0.8, "order": 2.0, "phase": 0.3}),
        ("torque_hum", {"amplitude": 0.04, "frequency": 37.0, "phase": 0.3}),
        ("position_inertia", {"amplitude": 0.4, "order": 2.0, "phase": 0.3}),
    ],
)
@pytest.mark.parametrize("way", [1, -1])
def test_effects_agree_with_scipy(effect: str, parameters: dict[str, float], way: int) -> None:
    """From rest in one direction and in the other."""
    plant = TWO if effect in COUPLING else ONE
    torque = np.full(150, way * 0.2)
    got = run_drive(plant, None, {effect: parameters}, torque=torque).truth
    expected = smooth_motion(plant, way * 0.2, effect, parameters, np.arange(150) * plant.dt)
    size = np.std(expected - run_drive(plant, None, torque=torque).truth)
    assert size > 0.05
    assert np.std(got - expected) < 1e-4 * size


@pytest.mark.parametrize("effect", [e for e in (*EFFECTS, *OUTSIDE) if e not in NOISE_EFFECTS])
def test_half_the_step_is_the_same_drive(effect: str) -> None:
    for seed in (1, 2):
        truth = random_truth(seed, effect)
        command = truth.command if effect == "contact" else truth.command[:2000]  # a stop is far away
        whole, half = (run_drive(truth.plant, command, truth.effects, substeps=n).truth for n in (40, 80))
        size = np.std(whole - run_drive(truth.plant, command).truth)
        assert size > 0
        assert np.std(whole - half) < 1e-3 * size, (effect, seed)


def test_an_axis_rests_against_a_stop_that_its_torque_bends() -> None:
    for way in (1.0, -1.0):
        stop = {"contact": {"stiffness": 50.0, "angle": 0.2 * way, "damping": 0.05}}
        end = run_drive(ONE, None, stop, torque=np.full(3000, 0.3 * way))
        assert end.position[-1] == pytest.approx(way * (0.2 + 0.3 / 50.0), rel=1e-6) and abs(end.truth[-1]) < 1e-6


def test_an_inertia_that_grows_takes_a_momentum_along() -> None:
    """J (1 + r t) w = T t without friction."""
    free, rate = replace(ONE, D=0.0), 2.0
    t = np.arange(500) * ONE.dt
    got = run_drive(free, None, {"growing_inertia": {"rate": rate}}, torque=np.full(500, 0.1)).truth
    np.testing.assert_allclose(got, 0.1 * t / (ONE.J * (1.0 + rate * t)), rtol=1e-9)


def test_the_chain_between_controller_and_shaft() -> None:
    """Saturation, dead band, clamps and rate limit sample by sample, from the log alone."""
    command = levels(ONE)
    effects = {
        "torque_saturation": {"limit": 0.3},
        "torque_dead_band": {"width": 0.02},
        "integrator_clamp": {"limit": 0.08},
        "command_rate_limit": {"rate": 4000.0},
    }
    log = run_drive(ONE, command, effects)
    reference, integral, last = 0.0, 0.0, 0.0
    for n, r in enumerate(command):
        reference += np.clip(r - reference, -4.0, 4.0)
        error = reference - log.velocity[n]
        integral = np.clip(integral + ONE.ki * ONE.dt / 2 * (error + last), -0.08, 0.08)
        last = error
        assert log.torque[n] == pytest.approx(ONE.kp * error + integral, abs=1e-12)
    limited = np.clip(log.torque, -0.3, 0.3)
    acting = np.sign(limited) * np.maximum(np.abs(limited) - 0.02, 0)
    assert (np.abs(log.torque) > 0.3).sum() > 5
    assert np.array_equal(run_drive(ONE, None, torque=acting).truth, log.truth)


def test_the_sensor() -> None:
    ripple = {"velocity_ripple": {"amplitude": 5e-3, "order": 2.0, "phase": 0.7}, "velocity_quantisation": {"step": 0.25}}
    log = run_drive(ONE, levels(ONE), ripple)
    assert np.array_equal(log.velocity, 0.25 * np.round(log.truth * (1 + 0.01 * np.cos(2 * log.position + 0.7)) / 0.25))


def test_noise_is_inside_the_loop() -> None:
    command = levels(ONE, 400)
    for name in ("white", "encoder", "coloured"):
        record = rig(ONE, command, noise=name, seed=3)
        error = command - record.velocity
        integral = np.cumsum(ONE.ki * ONE.dt / 2 * (error + np.concatenate([[0], error[:-1]])))
        assert record.torque is not None
        assert np.abs(record.torque - ONE.kp * error - integral).max() < 1e-12
        again, other = (rig(ONE, command, noise=name, seed=s) for s in (3, 4))
        assert again.digest == record.digest
        assert name == "encoder" or other.digest != record.digest


def test_an_encoder_gives_a_lattice_without_delay() -> None:
    command = levels(ONE, 400)
    line = NOISES["encoder"].encoder / ONE.dt
    record, truth = rig(ONE, command, noise="encoder"), run_drive(ONE, command).truth
    counts = record.velocity / line
    assert np.abs(counts - np.round(counts)).max() < 1e-9
    error = record.velocity - run_drive(ONE, command, encoder=NOISES["encoder"].encoder).truth
    assert abs(np.sum(error)) < line  # what was rounded away comes back
    assert np.std(record.velocity - truth) < line
    fine = replace(NOISES["differenced"], encoder=1e-7)
    late = run_drive(ONE, command, {"transport_delay": {"delay": ONE.dt / 2}}).velocity
    assert np.std(rig(ONE, command, noise=fine).velocity - late) < 0.4 * np.std(late - truth)
    assert np.std(rig(ONE, command, noise=replace(fine, differenced=False)).velocity - truth) < 1e-3


def test_coloured_torque_is_what_it_says() -> None:
    noise = replace(NOISES["coloured"], white=0.0)
    quiet = replace(ONE, kp=0.0, ki=0.0, D=1e-9, J=1.0)  # dw/dt is the torque
    record = rig(quiet, np.zeros(40000), noise=noise, seed=1)
    torque = np.diff(record.velocity) / quiet.dt
    assert np.std(torque) == pytest.approx(0.004, rel=0.1)
    assert torque[1:] @ torque[:-1] / (torque @ torque) == pytest.approx(0.98, abs=0.005)


def test_outliers_spoil_the_log_and_not_the_drive() -> None:
    clean, spoiled = (rig(ONE, levels(ONE), e, seed=1) for e in ({}, {"outliers": {"fraction": 0.02}}))
    assert np.count_nonzero(clean.velocity != spoiled.velocity) == round(0.02 * len(clean))
    assert clean.torque is not None and spoiled.torque is not None and np.array_equal(clean.torque, spoiled.torque)


def test_random_cases_repeat_themselves_and_obey() -> None:
    for kind in KINDS:
        record, validation, controller, truth = random_case(5, ("coulomb_friction", "transport_delay"), kind, torque_logged=False)
        again = random_case(5, ("coulomb_friction", "transport_delay"), kind, torque_logged=False)[0]
        assert record.digest == again.digest and record.torque is None
        assert (validation is None) == (kind == "step")
        assert len(record) == (250 if kind == "step" else 3500)
        assert (controller.kp, controller.ki) == (truth.plant.kp, truth.plant.ki)
        assert truth.names == ("coulomb_friction", "transport_delay")
    sizes = [random_truth(s, "coulomb_friction").effects["coulomb_friction"]["torque"] for s in range(12)]
    assert 0.025 <= min(sizes) < 0.045 and 0.06 < max(sizes) <= 0.1
    assert random_truth(1, "torque_lag", factor=3.0).effects["torque_lag"]["time_constant"] == pytest.approx(3e-3)


def test_plants_stay_near_the_nominal_ones_and_are_well_tuned() -> None:
    rng = np.random.default_rng(1)
    nominal = {p.name: p for p in nominal_plants()}
    for _ in range(30):
        plant = random_plant(rng)
        for name in ("J", "D", "JL", "DL", "KG", "DG"):
            assert getattr(plant, name) == pytest.approx(getattr(nominal[plant.name], name), rel=0.3001)
        speed = run_drive(plant, np.full(round(0.8 / plant.dt), 50.0)).truth
        assert speed.max() < 70 and np.abs(speed[-20:] - 50).max() < 0.5


def test_wrong_use_is_refused() -> None:
    with pytest.raises(ValueError, match="between two masses"):
        run_drive(ONE, levels(ONE), {"backlash": {"gap": 0.01}})
    with pytest.raises(ValueError, match="takes"):
        run_drive(ONE, levels(ONE), {"coulomb_friction": {"level": 0.05}})
    with pytest.raises(RanAwayError):
        run_drive(replace(ONE, kp=50.0), levels(ONE), {"transport_delay": {"delay": 5e-3}})
    drive, at_load = drive_values(ONE, {})
    assert drive | {"J1": 1e-3, "D1": 0} == fields() == at_load


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e in SHAFT])
def test_effects_at_the_load_agree_with_the_fine_integrator(effect: str) -> None:
    """Two simulations that share no code: event by event, and 200 explicit steps a sample with friction by clipping."""
    command = levels(TWO, 30)[:200]
    values = draw_effect(effect, 1.0, TWO, len(command), np.random.default_rng(1))
    masses = (TWO.J, TWO.D), (TWO.JL, TWO.DL), (TWO.KG, TWO.DG)
    case = FineCase(TWO.dt, "sampled", command, *masses, TWO.kp, TWO.ki, at_load={effect: values})
    fine = integrate([case], fine=200).velocity[:, 0]
    here, motor, without = (
        run_drive(TWO, command, effects).truth for effects in ({effect + AT_LOAD: values}, {effect: values}, {})
    )
    changed = float(np.sqrt(np.mean((here - without) ** 2)))
    assert np.sqrt(np.mean((here - fine) ** 2)) < 0.01 * changed
    assert np.sqrt(np.mean((here - motor) ** 2)) > 0.02 * changed, "the end of the shaft shows"


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e in SHAFT])
def test_effects_at_both_ends_agree_with_the_fine_integrator(effect: str) -> None:
    """The levels at the load 15 % larger: neither end stops when the other does."""
    command = levels(TWO, 30)[:200]
    values = draw_effect(effect, 1.0, TWO, len(command), np.random.default_rng(1))
    larger = {name: value * (1.15 if name in ("torque", "torque_positive", "amplitude", "coefficient") else 1.0)
              for name, value in values.items()}  # fmt: skip
    masses = (TWO.J, TWO.D), (TWO.JL, TWO.DL), (TWO.KG, TWO.DG)
    case = FineCase(TWO.dt, "sampled", command, *masses, TWO.kp, TWO.ki, effects={effect: values}, at_load={effect: larger})
    fine = integrate([case], fine=200).velocity[:, 0]
    both, motor, without = (
        run_drive(TWO, command, effects).truth for effects in ({effect: values, effect + AT_LOAD: larger}, {effect: values}, {})
    )
    changed = float(np.sqrt(np.mean((both - without) ** 2)))
    assert np.sqrt(np.mean((both - fine) ** 2)) < 0.01 * changed
    assert np.sqrt(np.mean((both - motor) ** 2)) > 0.02 * changed, "the second one shows"


def test_both_ends_hold_exactly_and_let_go_one_after_the_other() -> None:
    """A torque that rises slowly: the motor moves when it is above its own level, the load when the shaft carries more."""
    torque = np.concatenate([np.linspace(0.0, 0.2, 4000), np.zeros(2000)])
    friction = {"coulomb_friction": {"torque": 0.05}, "coulomb_friction@load": {"torque": 0.08}}
    log = run_drive(TWO, None, friction, torque=torque)
    moves = np.flatnonzero(log.truth)
    assert torque[moves[0]] == pytest.approx(0.05, abs=2e-4) and np.all(log.truth[: moves[0]] == 0.0)
    # Up to 0.13 N m the load holds, and the motor goes no further than the shaft twists: (T - 0.05)/K.
    before = np.flatnonzero(torque < 0.125)
    before = before[before < 4000]
    assert log.position[before[-1]] == pytest.approx((0.125 - 0.05) / TWO.KG, rel=0.02)
    assert log.position[3999] > 10.0 * log.position[before[-1]]
    assert np.all(log.truth[-100:] == 0.0)


def test_the_load_s_end_takes_two_masses_and_effects_of_the_shaft() -> None:
    for plant, effects in (
        (ONE, {"coulomb_friction@load": {"torque": 0.05}}),
        (TWO, {"transport_delay@load": {"delay": 1e-3}}),
    ):
        with pytest.raises(ValueError, match="effects of the shaft are at the load, and only of two masses"):
            drive_values(plant, effects)


def test_random_drives_of_two_masses_come_to_rest() -> None:
    plants = [two_masses(np.random.default_rng(seed)) for seed in range(30)]
    ratios = [p.JL / p.J for p in plants]
    assert 0.3 <= min(ratios) < 0.6 and 5.0 < max(ratios) <= 10.0
    assert all(comes_to_rest(p, {}) for p in plants)
