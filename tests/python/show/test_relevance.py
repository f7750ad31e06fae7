"""What is left, in size: beyond the noise, below an asked accuracy, and which values it can have bent."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.cli.accuracy import accuracy_of
from gaident.diagnosis.note import Note
from gaident.drive.drive_file import Drive
from gaident.results.relevance import Relevance
from gaident.show.relevance_words import part_words, relevance_words
from gaident.show.units import scales_of

DT = 500e-6  # s
CONTROLLER = ga.PI(kp=0.06, ki=5.0)
RPM = scales_of({"velocity": "rpm"}, "rotary")


def waves(angle: float, velocity: float, time: float) -> float:
    """A torque of the angle that no effect has."""
    return float(0.1 * np.sin(angle / 2.0) + 0.05 * np.sin(angle / 1.3))


def hump(angle: float, velocity: float, time: float) -> float:
    """A torque of the velocity that no effect has."""
    return float(-0.16 * (velocity / 12.0) / (1.0 + (velocity / 12.0) ** 2))


def levels(n: int = 3000) -> NDArray[np.float64]:
    """Speeds of either sign, reached by ramps [rad/s]."""
    wanted = np.repeat([0.0, 15.0, -30.0, 60.0, -6.0, 6.0, -90.0, 45.0, -3.0, 3.0], n // 10)
    command = np.zeros(n)
    for k in range(1, n):
        command[k] = command[k - 1] + np.clip(wanted[k] - command[k - 1], -400.0 * DT, 400.0 * DT)
    return command


def one_mass(
    command: NDArray[np.float64], torque: Callable[[float, float, float], float], controller: ga.PI, noise: float = 0.02
) -> ga.Record:
    """J dw/dt = u - D w + torque(angle, w, t); the controller reads w with white noise."""
    J, D, substeps = 4.3e-4, 5e-3, 4
    kp, ki = controller.kp, controller.ki
    rng, h = np.random.default_rng(3), DT / substeps
    w = angle = integral = 0.0
    last, rows = None, []
    for k, r in enumerate(command.tolist()):
        measured = w + noise * float(rng.standard_normal())
        error = r - measured
        integral += ki * DT * (error + (0.0 if last is None else last)) / 2.0
        last = error
        u = kp * error + integral
        rows.append((measured, u))
        for i in range(substeps):
            w += h / J * (u - D * w + torque(angle, w, k * DT + i * h))
            angle += h * w
    velocity, driving = np.array(rows).T
    return ga.Record(DT, command=command, velocity=velocity, torque=driving)


@pytest.mark.parametrize(
    ("left", "why"),
    [
        (Relevance(0.5, 1.0), "noise"),
        (Relevance(0.5, 1.0, 0.2, 0.1), ""),
        (Relevance(0.5, 1.0, 0.05, 0.1), "noise"),
        (Relevance(0.5, 0.1, 0.2, 0.1, velocity_accuracy=0.6), "accuracy"),
        (Relevance(0.5, 1.0, velocity_accuracy=0.4), ""),
        (Relevance(0.5, 0.1, 0.2, 0.1, velocity_accuracy=0.6, torque_accuracy=0.1), ""),
        (Relevance(0.5, 0.1, None, None, torque_accuracy=0.1), ""),
    ],
)
def test_what_is_negligible(left: Relevance, why: str) -> None:
    assert left.negligible == why and Relevance.from_dict(left.to_dict()) == left


def said(relevance: Relevance | None, driver: str | None = "position", **more: Any) -> str:
    return relevance_words(SimpleNamespace(relevance=relevance, driver=driver, **more), "rotary", RPM)  # type: ignore[arg-type]


def test_the_size_is_in_the_users_unit_with_si_behind() -> None:
    left = Relevance(0.1, 0.3, 0.002, 0.004)
    assert said(left) == (
        "Beyond what noise leaves, it is 0.95 rpm (0.1 rad/s) rms in the velocity and 0.002 N m rms in the torque. In size that "
        "is negligible: noise alone leaves 2.9 rpm (0.3 rad/s) of a free run, noise and filter 0.004 N m of the torque. "
        "Significant means that chance does not make it."
    )
    assert said(Relevance(0.4, 0.3)).endswith("rms in the velocity; noise alone leaves 2.9 rpm (0.3 rad/s) of a free run.")
    assert "and nothing in the torque; noise alone leaves" in said(Relevance(0.4, 0.3, 0.0, 0.01))
    asked = Relevance(0.4, 0.3, 0.002, 0.004, 0.5, 0.001)
    assert said(asked).endswith(
        "that was asked for, 4.8 rpm (0.5 rad/s) of the velocity and 0.001 N m of the torque, is not met."
    )
    assert "is not met, though nothing of it is significant" in said(asked, None)
    assert said(left, None) == "" == said(None)
    assert said(Relevance(0.0, 0.3, 0.0, 0.004)) == (
        "In size it is negligible: noise alone leaves 2.9 rpm (0.3 rad/s) of a free run, noise and filter 0.004 N m of the "
        "torque, and the model leaves no more. Significant means that chance does not make it."
    )


def test_a_finding_beside_the_accuracy() -> None:
    few, more = (SimpleNamespace(gain=g) for g in (0.01, 0.5))
    dia: Any = SimpleNamespace(
        relevance=Relevance(0.1, 0.1, velocity_accuracy=0.3), before=SimpleNamespace(rmse=1.0), findings=(more, few)
    )
    assert (
        part_words(dia, more, "rotary", {})
        == "In the velocity it makes 0.87 rad/s rms, more than the accuracy that was asked for."
    )  # type: ignore[arg-type]
    assert "0.071 rad/s rms, less" in part_words(dia, few, "rotary", {})  # type: ignore[arg-type]


@pytest.mark.long
def test_waves_over_the_angle_bend_no_inertia_and_a_hump_over_the_velocity_bends_the_damping() -> None:
    over_angle, over_velocity = (ga.diagnose(one_mass(levels(), f, CONTROLLER), CONTROLLER, accuracy=10.0) for f in (waves, hump))
    for dia in (over_angle, over_velocity):
        assert dia.relevance is not None and dia.relevance.negligible == "accuracy"
        assert dia.relevance.velocity == pytest.approx(np.sqrt(dia.after.rmse**2 - dia.relevance.noise**2), rel=1e-9)
        assert ga.Diagnosis.from_dict(dia.to_dict()).relevance == dia.relevance
    assert over_angle.driver == "position" and over_velocity.driver == "velocity"
    assert over_angle.relevance is not None and over_angle.relevance.bent == ("viscous_friction",)
    inertia = over_angle.mechanics["inertia"]
    assert abs(inertia.value - 4.3e-4) < 2.0 * inertia.std
    assert over_velocity.relevance is not None and "viscous_friction" in over_velocity.relevance.bent
    damping = over_velocity.mechanics["viscous_friction"]
    assert damping.value > 1.5 * 5e-3 and damping.value - 5e-3 < 3.0 * damping.std, "it contains the friction that is not found"
    text = over_angle.summary()
    assert "Mechanics\n" in text and text.count("may be biased by what is left") == 1


@pytest.mark.parametrize("wrong", [-1.0, "1 rpm", True, {"speed": 1.0}, {"velocity": 0.0}])
def test_a_wrong_accuracy_is_refused(wrong: Any) -> None:
    with pytest.raises(ga.GaidentError, match="accuracy"):
        ga.diagnose(one_mass(levels(), hump, CONTROLLER), CONTROLLER, accuracy=wrong)


@pytest.mark.long
def test_quick_names_the_first_cause_and_says_so() -> None:
    record = one_mass(levels(), lambda angle, w, t: -0.1 - 0.004 * np.sin(7.0 * angle), CONTROLLER)
    quick, whole = (ga.diagnose(record, CONTROLLER, quick=q) for q in (True, False))
    assert [f.effect for f in quick.causes] == ["load_torque"]
    assert {f.effect for f in whole.causes} == {"load_torque", "cogging"}
    assert any("stops at the first cause" in note for note in quick.notes)
    assert quick.simulations < whole.simulations
    with pytest.raises(ga.GaidentError, match="quick is 1"):
        ga.diagnose(record, CONTROLLER, quick=1)  # type: ignore[arg-type]


def test_progress_says_the_time_that_is_left() -> None:
    now, told = [0.0], []
    note = Note(lambda fraction, message: told.append(fraction), clock=lambda: now[0])
    note(0.01, "replaying")
    now[0] = 6.0
    note.searching()
    note(0.02, "identifying")
    now[0] = 6.8
    note.identified()
    note(None, "looking")  # of 6 s and a search of 0.8 s/0.2 = 4 s: 6.8 s are more than two thirds
    assert told[-1] == pytest.approx(0.6 + 0.4 * 0.216)
    now[0] = 10.0
    note.searching()  # as long as the one before: 4 s
    note(0.03, "once more")
    assert told[-1] == pytest.approx(10.0 / 14.0 + 4.0 / 14.0 * 0.03)
    assert told == sorted(told)


def drive_of(**sections: Any) -> Drive:
    rest = {"general": {}, "columns": {}, "units": {}, "controller_values": {}, "space_values": {}, **sections}
    return Drive(**rest)


def test_the_command_line_takes_the_accuracy_in_the_users_units() -> None:
    rated = drive_of(general={"rated_torque": 2.4})
    found, drive = accuracy_of(["1 rpm", "2 %"], rated)
    assert found == pytest.approx({"velocity": 2.0 * np.pi / 60.0, "torque": 0.048})
    assert drive.show == {"velocity": "rpm", "torque": "%"}
    found, drive = accuracy_of(["3"], drive_of(show={"velocity": "rpm"}))
    assert found == pytest.approx({"velocity": 6.0 * np.pi / 60.0}) and drive.show == {"velocity": "rpm"}
    assert accuracy_of(["3"], drive_of())[0] == {"velocity": 3.0} and accuracy_of(None, rated) == ({}, rated)
    assert accuracy_of(["5 mm/s"], drive_of(general={"axis": "linear"}))[0] == pytest.approx({"velocity": 0.005})


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["fast"], "give a number above 0"),
        (["0 rpm"], "give a number above 0"),
        (["1 furlong"], "'furlong' is no unit"),
        (["1 mm/s"], "no unit of a velocity or a torque of a rotary axis"),
        (["1 rpm", "2 rad/s"], "a second one of the velocity"),
        (["2 %"], "rated_torque"),
    ],
)
def test_a_wrong_accuracy_of_the_command_line_is_refused(texts: list[str], words: str) -> None:
    with pytest.raises(ga.GaidentError, match=words):
        accuracy_of(texts, drive_of())
