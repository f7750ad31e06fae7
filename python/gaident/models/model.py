"""The factored transfer function G(s) = K prod 1/(s + A1) prod (s + B2)/(s + A2) (the paper's equation 2)."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident import _core
from gaident.checks import known_keys, real_number
from gaident.control import core
from gaident.control.controller import Controller
from gaident.control.pi import PI, checked_pi
from gaident.errors import ModelError
from gaident.models.discrete import Discrete, require_strictly_proper
from gaident.models.effects import Effect, checked_effects, without
from gaident.models.effects_linear import LINEAR, Transfer, frequencies, response_of
from gaident.models.roots import Mode, canonical_roots, checked_gain, modes_of, ratio_of_products, roots_of, text_of
from gaident.providers import provided

Roots = Sequence[complex] | NDArray[np.complex128] | NDArray[np.float64]


@dataclass(frozen=True, init=False, repr=False)
class Model:
    """A drive as gain, poles and zeros: torque [N m] to motor velocity [rad/s].

        G(s) = gain * prod(s - zeros) / prod(s - poles)

    Complex roots come in conjugate pairs, in any order; asymmetry by rounding (1e-9 relative) is repaired.
    They are kept in one order, so that equal models compare equal: real roots by ascending magnitude, then pairs by ascending
    magnitude, positive imaginary part first.

    Parameters
    ----------
    gain : float
        Gain K [(rad/s)^(p+1)/(N m)], not 0; for p = 1 it is 1/J_M [1/(kg m^2)].
    poles : sequence of complex
        Roots of the denominator [rad/s], the paper's -A: a stable pole has a negative real part.
    zeros : sequence of complex
        Roots of the numerator [rad/s], the paper's -B, at most as many as poles.
    effects : iterable of Effect
        What the drive does beyond that; kept in the order of `gaident.effects.table()`. See `with_effect`.

    Raises
    ------
    ModelError
        For a gain of 0 or of a size below 1e-300 or above 1e250, roots beyond 1e50 rad/s or without their conjugates, more zeros
        than poles, and effects that the model cannot carry.

    Examples
    --------
    >>> import gaident as ga
    >>> zeros = [-4.0 + 94.0j, -4.0 - 94.0j]
    >>> model = ga.Model(gain=6545.0, poles=[-15.0, -10.0 + 151.0j, -10.0 - 151.0j], zeros=zeros)
    >>> model.p, model.q, model.stable, round(model.static_gain, 1)
    (1, 2, True, 168.7)
    >>> model.with_effect("coulomb_friction", torque=0.05).effects
    (Effect('coulomb_friction', {'torque': 0.05}),)
    """

    gain: float
    poles: tuple[complex, ...]
    zeros: tuple[complex, ...]
    effects: tuple[Effect, ...]

    def __init__(self, gain: float, poles: Roots = (), zeros: Roots = (), effects: Iterable[Effect] = ()) -> None:
        object.__setattr__(self, "gain", checked_gain(gain))
        object.__setattr__(self, "poles", canonical_roots(poles, "poles"))
        object.__setattr__(self, "zeros", canonical_roots(zeros, "zeros"))
        if len(self.zeros) > len(self.poles):
            raise ModelError(
                f"zeros has {len(self.zeros)} roots and poles {len(self.poles)}: a drive has at "
                "least as many poles as zeros; drop zeros or add poles"
            )
        object.__setattr__(self, "effects", checked_effects(effects, self.p, self.q))

    @overload
    def with_effect(self, name: str, **parameters: float | Sequence[float]) -> Model: ...
    @overload
    def with_effect(self, name: str, *, side: str, **parameters: float | Sequence[float]) -> Model: ...
    def with_effect(self, name: str, *, side: Any = "motor", **parameters: Any) -> Model:
        """Return the same drive with one more effect, in place of one of the same name and side.

        Parameters
        ----------
        name : str
            Name of the effect, see `gaident.effects.table()`.
        side : {"motor", "load"}
            Where a shaft effect acts.
            With two masses it may be the load: the effect then has the load's velocity and angle,
            which starts where the motor's does. An effect may be present at both sides, with parameters of its own at each.
        **parameters : float or sequence of float
            All its parameters by name, SI units; of several waves lists, or order_2 and so on for those of the second wave.

        Returns
        -------
        Model
            A new model; this one stays as it is.

        Raises
        ------
        ModelError
            For an unknown effect, unknown or missing parameters, values outside their physical bounds, and where the model cannot
            carry it: p = 0; a nonlinear coupling and effects at the load without the structure of two masses (p = 1,
            q = 2) or together with extra_resonance.

        Examples
        --------
        >>> import gaident as ga
        >>> drive = ga.TwoMass(JM=1e-4, DM=0.003, JL=5.8e-4, DL=0.008, KG=2.6).model()
        >>> drive.with_effect("coulomb_friction", side="load", torque=0.05).effects
        (Effect('coulomb_friction', {'torque': 0.05}, side='load'),)
        """
        return self._with((*self.effects, Effect(name, parameters, side)))

    def without_effect(self, name: str, *, side: str | None = None) -> Model:
        """Return the same drive without this effect.

        Parameters
        ----------
        name : str
            Name of the effect.
        side : {"motor", "load"}, optional
            The side where it is taken out; None: wherever it is.

        Returns
        -------
        Model
            A new model; this one stays as it is.

        Raises
        ------
        ModelError
            Where the model has none of that name there.
        """
        return self._with(without(self.effects, name, side))

    @property
    def linear(self) -> Model:
        """The linear drive: extra_resonance in its poles and zeros, transport_delay, torque_lag, velocity_filter as effects."""
        kept = tuple(e for e in self.effects if e.name in LINEAR and e.row.place != "plant")
        return self.mechanism._with(kept) if kept else self.mechanism

    @property
    def mechanism(self) -> Model:
        """Poles and zeros alone: without effects, but with extra_resonance, which is one of the mechanism's, among them."""
        base = self._with(()) if self.effects else self
        for effect in self.effects:
            if effect.row.place == "plant":
                more = LINEAR[effect.name](effect.values)
                base = Model(base.gain * more.gain, [*base.poles, *more.poles], [*base.zeros, *more.zeros])
        return base

    def _with(self, effects: tuple[Effect, ...]) -> Model:
        model = object.__new__(Model)
        for name in ("gain", "poles", "zeros"):
            object.__setattr__(model, name, getattr(self, name))
        object.__setattr__(model, "effects", checked_effects(effects, self.p, self.q))
        return model

    def _require_linear(self, what: str) -> None:
        if names := ", ".join(effect.name for effect in self.effects if effect.name not in LINEAR):
            raise ModelError(f"{what} is of a linear model, and this one has effects ({names}): use model.linear")

    def __getstate__(self) -> dict[str, Any]:
        # What was made once is not part of the value.
        return {name: value for name, value in self.__dict__.items() if name not in ("_core_model", "_own")}

    @property
    def p(self) -> int:
        """Number of modules 1/(s + A1): poles in excess of zeros."""
        return len(self.poles) - len(self.zeros)

    @property
    def q(self) -> int:
        """Number of modules (s + B2)/(s + A2): zeros."""
        return len(self.zeros)

    @property
    def order(self) -> int:
        """Number of poles, p + q."""
        return len(self.poles)

    @property
    def stable(self) -> bool:
        """True if every pole has a negative real part (an integrating drive, with a pole at 0, is not)."""
        return all(pole.real < 0.0 for pole in self.poles)

    @property
    def static_gain(self) -> float:
        """G(0) [rad/s per N m]: where a constant torque of 1 N m ends; infinite with a pole at 0."""
        integrators = self.poles.count(0.0) - self.zeros.count(0.0)
        if integrators < 0:
            return 0.0
        value = self.gain * ratio_of_products(self.zeros, self.poles)
        return value if integrators == 0 else math.copysign(math.inf, value)

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Natural frequency and damping, one row per real root and per pair; poles first."""
        return (*modes_of("pole", self.poles), *modes_of("zero", self.zeros))

    def frequency_response(self, omega: ArrayLike) -> NDArray[np.complex128]:
        """Return G(j omega), complex, of the shape of `omega` [rad/s]; not finite where j omega is a pole.

        Delay, lag and filter of the linear drive are part of it. Raises ModelError for a model with other effects.
        """
        self._require_linear("frequency_response")
        parts = Transfer(self.gain, self.poles, self.zeros), *(LINEAR[e.name](e.values) for e in self.effects)
        return response_of(parts, frequencies(omega))

    def discrete(self, dt: float, controller: PI | None = None) -> Discrete:
        """Return the difference equation (7) from command to velocity; without a controller from torque to velocity.

        Parameters
        ----------
        dt : float
            Sample time [s].
        controller : PI, optional
            The loop: bilinear or held as its `loop` says, its limits left out (the equation is linear).
            None: the drive alone, by zero-order hold.

        Returns
        -------
        Discrete
            The coefficients alpha and beta.

        Raises
        ------
        ModelError, SettingsError
            For dt <= 0, p = 0 in a sampled loop, a model with effects, and a controller that is no bare PI.
        """
        self._require_linear("discrete")
        if self.effects:
            raise ModelError(f"equation (7) has no {self.effects[0].name}: use model.to_scipy(dt), which has, or model.mechanism")
        sample_time = real_number(dt, "dt", ModelError, "give the sample time in s, > 0")
        if sample_time <= 0.0:
            raise ModelError(f"dt is {sample_time:g}: give the sample time in s, > 0")
        controller = checked_pi(controller, "equation (7) is")
        require_strictly_proper(self.p, controller)
        poles, zeros = (np.array(roots, dtype=np.complex128) for roots in (self.poles, self.zeros))
        found = Discrete(*core.discrete(self.gain, poles, zeros, sample_time, controller))
        if not np.all(np.isfinite([*found.alpha, *found.beta])):
            raise ModelError(f"dt is {sample_time:g}: within one such step the model grows beyond all numbers; give a shorter dt")
        return found

    def to_scipy(self, dt: float | None = None, *, pade: int | None = None) -> Any:
        """Return the same as a linear system of scipy.signal, torque [N m] to velocity [rad/s].

        The linear effects (extra_resonance, transport_delay, torque_lag, velocity_filter) are part of it.

        Parameters
        ----------
        dt : float, optional
            None: continuous, scipy.signal.ZerosPolesGain.
            A sample time [s]: sampled behind a zero-order hold, scipy.signal.StateSpace,
            exact with a delay of any fraction of a sample.
        pade : int, optional
            Order, 1 to 10, of the Pade approximation of a transport_delay in the continuous system.

        Returns
        -------
        scipy.signal.ZerosPolesGain or scipy.signal.StateSpace
            The system.

        Raises
        ------
        ModelError
            For other effects, a delay with neither dt nor pade, and p = 0 with dt.
        """
        return provided("to_scipy")(self, dt, pade)

    def to_control(self, dt: float | None = None, *, pade: int | None = None) -> Any:
        """Return the same as a system of python-control, torque [N m] to velocity [rad/s].

        Parameters
        ----------
        dt : float, optional
            None: control.TransferFunction. A sample time [s]: control.StateSpace, behind a zero-order hold.
        pade : int, optional
            As `to_scipy` takes it.

        Returns
        -------
        control.TransferFunction or control.StateSpace
            The system.

        Raises
        ------
        ImportError
            Where python-control is missing; with the way to get it.
        ModelError
            As `to_scipy`.
        """
        return provided("to_control")(self, dt, pade)

    def to_c(
        self,
        path: str | os.PathLike[str] | None,
        dt: float,
        controller: Controller | None = None,
        *,
        name: str | None = None,
        substeps: int | None = None,
        axis: str = "rotary",
    ) -> str:
        """Write the model as one C99 file without dependencies, a recurrence of fixed step.

        From rest it gives what `gaident.simulate` gives for a record without position, up to rounding.
        All effects of the library are part of it.

        Parameters
        ----------
        path : str or path-like, or None
            File to write; None: none is written.
        dt : float
            Sample time of its steps [s].
        controller : PI or Cascade, optional
            With one the file is the closed loop, command [rad/s], or with a position controller position command [rad], to
            velocity [rad/s].
            One with a period of its own takes dt/period samples a step, and a number for each.
            None: the drive alone, torque [N m] (held over each sample) to velocity.
        name : str, optional
            Beginning of every C name; None: that of the file.
        substeps : int, optional
            Steps per sample (of the controller, where it is the faster one) of a model with effects; None: as many as it needs.
        axis : str, optional
            "rotary", or "linear" for units of m and N in the file's comments.

        Returns
        -------
        str
            The text of the file.

        Raises
        ------
        ModelError
            For user-defined effects, effects in the continuous loop, p = 0 outside it,
            a delay of more than a million torques, and a dt, name or substeps that are none.
        ControllerError
            For a controller with a number that is None, and a dt that is no whole multiple of its period.
        SettingsError
            For another axis.
        """
        text: str = provided("write_c")(self, path, dt, controller, name, substeps, axis)
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return the model for JSON: {"gain": K, "poles": [[re, im], ...], "zeros": [[re, im], ...], "effects": [...]}.

        A model without effects has no key "effects".
        """
        data: dict[str, Any] = {
            "gain": self.gain,
            "poles": [[r.real, r.imag] for r in self.poles],
            "zeros": [[r.real, r.imag] for r in self.zeros],
        }
        if self.effects:
            data["effects"] = [effect.to_dict() for effect in self.effects]
        return data

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Model:
        """Return the model of what `to_dict` gave; a real root may be written as one number. Raises ModelError."""
        names = ("gain", "poles", "zeros", "effects")
        values: dict[str, Any] = known_keys(data, "the model", names, ("gain",), ModelError)
        effects = values.get("effects", ())
        if not isinstance(effects, (list, tuple)):
            raise ModelError(f"effects is {effects!r}: give a list of {{'name': ..., 'parameters': {{...}}}}")
        found = [Effect.from_dict(entry) for entry in effects]
        return cls(values["gain"], roots_of(values, "poles"), roots_of(values, "zeros"), found)

    def __repr__(self) -> str:
        effects = f", effects={list(self.effects)!r}" if self.effects else ""
        return f"Model(gain={self.gain!r}, poles={text_of(self.poles)}, zeros={text_of(self.zeros)}{effects})"

    def own_effects(self) -> tuple[Effect, ...]:
        """Return the user-defined effects that are not neutral; raise ModelError where one is no longer registered."""
        own: tuple[Effect, ...] | None = self.__dict__.get("_own")
        if own is None:
            own = tuple(effect for effect in self.effects if effect.own)
            object.__setattr__(self, "_own", own)
        return tuple(effect for effect in own if not effect.neutral) if own else own

    def core(self) -> _core.EffectModel:
        """Return the model as the core takes it, without user-defined effects; made once."""
        made: _core.EffectModel | None = self.__dict__.get("_core_model")
        if made is None:
            poles, zeros = (np.array(roots, dtype=np.complex128) for roots in (self.poles, self.zeros))
            built_in = [effect.of_core() for effect in self.effects if not effect.own]
            made = _core.EffectModel(self.gain, poles, zeros, built_in)
            object.__setattr__(self, "_core_model", made)
        return made
