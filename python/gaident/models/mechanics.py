"""One and two masses: from mechanical parameters to the factored model and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from gaident.axis import Text, say, unit_text
from gaident.checks import LARGEST, known_keys, one_of, real_number, yes_or_no
from gaident.data.signals.arrays import floats
from gaident.errors import ModelError
from gaident.models import two_mass
from gaident.models.factors import FactorCounts
from gaident.models.model import Model
from gaident.models.roots import polynomial_roots
from gaident.models.two_mass import Matrix, Vector
from gaident.models.two_mass_fit import deviations, fit_two_masses
from gaident.policy.table import POLICY


@dataclass(frozen=True)
class OneMass:
    """A rigid drive: J dw/dt = torque - D w.

    Parameters
    ----------
    J : float
        Moment of inertia [kg m^2], > 0.
    D : float
        Viscous damping [N m s/rad], >= 0.
    inconsistency : float, optional
        Of a result of an identification: 0, because two numbers of the model determine two parameters.
        Such a result may be unphysical, see `notes`.
    std : mapping of str to float
        Standard deviations by field name, in the field's unit, where a covariance was known.

    Raises
    ------
    ModelError
        For a value that is no finite number, or out of its range.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.OneMass(J=2e-3, D=0.01).model()
    Model(gain=500.0, poles=[-5.0], zeros=[])
    """

    UNITS: ClassVar[Mapping[str, str]] = {"J": "kg m^2", "D": "N m s/rad"}

    J: float
    D: float
    inconsistency: float | None = None
    std: Mapping[str, float] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        for name, value in _checked(self, positive=("J",), not_negative=("D",)).items():
            object.__setattr__(self, name, value)

    def model(self) -> Model:
        """Return the factored model: K = 1/J, A11 = D/J (equation 4); raise ModelError where no drive has such numbers."""
        if self.J == 0.0:
            raise ModelError(f"J is {self.J:g}: without inertia there is no one-mass model")
        try:
            return Model(1.0 / self.J, [-self.D / self.J])
        except ModelError as error:
            raise ModelError(f"J is {self.J:g} and D is {self.D:g}: {error}") from None

    @classmethod
    def from_model(cls, model: Model) -> OneMass:
        """Return the mechanism of a model with p = 1, q = 0; raise ModelError for any other structure."""
        _require(model, 1, 0, "one-mass")
        return _one_mass(model, None)

    @property
    def notes(self) -> tuple[Text, ...]:
        """What is not physical, one sentence each; a damping may be negative by two standard deviations."""
        return _notes(self, ("J",), ("D",), 0.0)

    @property
    def physical(self) -> bool:
        """True if `notes` is empty: such a mechanism can exist."""
        return not self.notes

    def to_dict(self) -> dict[str, Any]:
        """Return the mechanism for JSON."""
        return {"structure": "one mass", **asdict(self)}


@dataclass(frozen=True)
class TwoMass:
    """Motor and load on a shaft (Fig. 1b of the paper), torque and measured velocity at the motor.

    Parameters
    ----------
    JM : float
        Moment of inertia of the motor [kg m^2], > 0.
    DM : float
        Viscous damping of the motor [N m s/rad], >= 0.
    JL : float
        Moment of inertia of the load [kg m^2], > 0.
    DL : float
        Viscous damping of the load [N m s/rad], >= 0.
    KG : float
        Stiffness of the shaft [N m/rad], > 0.
    DG : float
        Damping in the shaft [N m s/rad], >= 0; the paper has 0.
    inconsistency : float, optional
        Of a result of an identification, see `mechanics_from_model`. Such a result may be unphysical, see `notes`.
    std : mapping of str to float
        Standard deviations by field name, and of "J", "D" and "inconsistency", where a covariance was known.
    with_shaft_damping : TwoMass, optional
        Of a result of an identification: the mechanism with DG free.

    Raises
    ------
    ModelError
        For a value that is no finite number, or out of its range.

    Examples
    --------
    >>> import gaident as ga
    >>> drive = ga.TwoMass(JM=1e-4, DM=0.003, JL=6e-4, DL=0.008, KG=2.6)
    >>> round(drive.antiresonance, 1), round(drive.resonance, 1), (drive.model().p, drive.model().q)
    (65.8, 174.2, (1, 2))
    """

    UNITS: ClassVar[Mapping[str, str]] = {
        "JM": "kg m^2",
        "DM": "N m s/rad",
        "JL": "kg m^2",
        "DL": "N m s/rad",
        "KG": "N m/rad",
        "DG": "N m s/rad",
        "J": "kg m^2",
        "D": "N m s/rad",
    }

    JM: float
    DM: float
    JL: float
    DL: float
    KG: float
    DG: float = 0.0  # no decision: what an argument may be: a shaft without damping
    inconsistency: float | None = None
    std: Mapping[str, float] = field(default_factory=dict, hash=False)
    with_shaft_damping: TwoMass | None = None

    def __post_init__(self) -> None:
        for name, value in _checked(self, positive=("JM", "JL", "KG"), not_negative=("DM", "DL", "DG")).items():
            object.__setattr__(self, name, value)

    def model(self) -> Model:
        """Return the factored model (equation 5), p = 1 and q = 2; raise ModelError where a mass has no inertia."""
        if self.JM == 0.0 or self.JL == 0.0:
            raise ModelError(f"JM is {self.JM:g} and JL is {self.JL:g}: without inertia there is no two-mass model")
        with np.errstate(all="ignore"):  # numbers so far apart that the equations overflow are told as what they make
            c = two_mass.coefficients_of_mechanics(self._vector())
            if not np.all(np.isfinite(c)):
                raise ModelError(f"{self}: a coefficient of its transfer function is beyond all numbers; correct the values")
            roots = polynomial_roots(c[1:4]), polynomial_roots(c[4:6])
        try:
            return Model(c[0], *roots)
        except ModelError as error:
            raise ModelError(f"{self}: {error}") from None

    @classmethod
    def from_model(cls, model: Model, free_shaft_damping: bool = False) -> TwoMass:
        """Return the mechanism of a model with p = 1, q = 2.

        Parameters
        ----------
        model : Model
            The factored model.
        free_shaft_damping : bool
            False: at DG = 0, by least squares in relative deviations. True: with DG free, which meets all six numbers.

        Returns
        -------
        TwoMass
            The mechanism; it may be unphysical, see `notes`.

        Raises
        ------
        ModelError
            For any other structure, and where no such mechanism exists.
        """
        _require(model, 1, 2, "two-mass")
        yes_or_no(free_shaft_damping, "free_shaft_damping", ModelError)
        found = _two_masses(model, None)
        if found is None:
            what = "zeros has a root at 0" if 0.0 in model.zeros else f"{model!r} has roots too far apart"
            raise ModelError(f"{what}: no stiffness between two masses gives that; use a one-mass model")
        if not free_shaft_damping:
            return found
        if found.with_shaft_damping is None:
            raise ModelError(
                f"{model!r} is no two-mass system with any shaft damping: "
                "use free_shaft_damping=False and look at its inconsistency"
            )
        return found.with_shaft_damping

    @property
    def J(self) -> float:
        """Total moment of inertia JM + JL [kg m^2]."""
        return self.JM + self.JL

    @property
    def D(self) -> float:
        """Total viscous damping DM + DL [N m s/rad]."""
        return self.DM + self.DL

    @property
    def antiresonance(self) -> float:
        """Undamped natural frequency of the load on the shaft, sqrt(KG/JL) [rad/s]; nan if imaginary."""
        return _root(self.KG / self.JL) if self.JL else float("nan")

    @property
    def resonance(self) -> float:
        """Undamped natural frequency of both masses, sqrt(KG/JL + KG/JM) [rad/s]; nan if imaginary."""
        return _root(self.KG / self.JL + self.KG / self.JM) if self.JL and self.JM else float("nan")

    @property
    def notes(self) -> tuple[Text, ...]:
        """What is not physical, one sentence each; a damping may be negative by two standard deviations."""
        rounding = 1e-9 * abs(self.JM * self.KG) ** 0.5
        return _notes(self, ("JM", "JL", "KG"), ("DM", "DL", "DG"), rounding)

    @property
    def physical(self) -> bool:
        """True if `notes` is empty: such a mechanism can exist."""
        return not self.notes

    def to_dict(self) -> dict[str, Any]:
        """Return the mechanism for JSON."""
        data = {"structure": "two masses", **asdict(self)}
        if self.with_shaft_damping is not None:
            data["with_shaft_damping"] = self.with_shaft_damping.to_dict()
        return data

    def _vector(self) -> Vector:
        return np.array([self.JM, self.DM, self.JL, self.DL, self.KG, self.DG])


Mechanics = OneMass | TwoMass


def mechanics_from_model(model: Model, covariance: ArrayLike | None = None) -> Mechanics | None:
    """Return the mechanism behind a model: OneMass for p = 1, q = 0; TwoMass for p = 1, q = 2; otherwise None.

    The six numbers of a two-mass model over-determine its five parameters at DG = 0.
    The result is their least squares, weighted with the covariance (without one: in relative deviations).

    Parameters
    ----------
    model : Model
        The factored model.
    covariance : array_like, shape (n, n), optional
        Covariance of the natural parameters of the model, in the order and units of `factor_parameters(model)`.
        With it the result carries standard deviations, to first order.

    Returns
    -------
    OneMass, TwoMass or None
        The mechanism; None also for two masses with a zero at 0, which no stiffness gives, or with roots that are too far apart.
        Its `inconsistency` is abs(1 - K_G by product / K_G by pairwise): how far the two equations for the stiffness are apart;
        compare it with std["inconsistency"].
        Its `with_shaft_damping` meets all six numbers.
        What comes out unphysical is data: see `notes`.

    Raises
    ------
    ModelError
        Where `covariance` is no such matrix.

    Examples
    --------
    >>> import gaident as ga
    >>> drive = ga.TwoMass(JM=1e-4, DM=0.003, JL=6e-4, DL=0.008, KG=2.6)
    >>> found = ga.mechanics_from_model(drive.model())
    >>> round(found.JL, 6), round(found.KG, 3), found.physical
    (0.0006, 2.6, True)
    """
    if not isinstance(model, Model):
        raise ModelError(f"model is a {type(model).__name__}: give a gaident.Model")
    cov = _checked_covariance(model, covariance)
    if (model.p, model.q) == (1, 0):
        return _one_mass(model, cov)
    if (model.p, model.q) == (1, 2):
        return _two_masses(model, cov)
    return None


def mechanics_from_dict(data: Mapping[str, Any]) -> Mechanics:
    """The inverse of `OneMass.to_dict` and `TwoMass.to_dict`."""
    kinds: dict[str, tuple[type[OneMass] | type[TwoMass], tuple[str, ...], tuple[str, ...]]] = {
        "one mass": (OneMass, ("J", "D"), ("inconsistency", "std")),
        "two masses": (TwoMass, ("JM", "DM", "JL", "DL", "KG"), ("DG", "inconsistency", "std", "with_shaft_damping")),
    }
    name = one_of(data.get("structure"), "structure", kinds, ModelError)
    kind, needed, more = kinds[name]
    values: dict[str, Any] = known_keys(data, name, ("structure", *needed, *more), needed, ModelError)
    del values["structure"]
    if values.get("with_shaft_damping") is not None:
        values["with_shaft_damping"] = mechanics_from_dict(values["with_shaft_damping"])
    return kind(**values)


def _one_mass(model: Model, cov: Matrix | None) -> OneMass:
    K, a = model.gain, -model.poles[0].real
    std = {}
    if cov is not None:
        std = deviations(np.array([[-1.0 / K**2, 0.0], [-a / K**2, 1.0 / K]]), cov, ("J", "D"))
    return OneMass(1.0 / K, a / K + 0.0, 0.0, std)


def _two_masses(model: Model, cov: Matrix | None) -> TwoMass | None:
    found = fit_two_masses(model, cov)
    if found is None:
        return None
    damped = None if found.shaft is None else _named(found.shaft, 0.0, found.shaft_std, None)
    return _named(found.mechanics, found.inconsistency, found.std, damped)


def _named(v: Vector, inconsistency: float, std: dict[str, float], damped: TwoMass | None) -> TwoMass:
    JM, DM, JL, DL, KG, DG = (float(value) for value in v)
    return TwoMass(JM, DM, JL, DL, KG, DG, inconsistency, std, damped)


def _require(model: Model, p: int, q: int, name: str) -> None:
    if not isinstance(model, Model):
        raise ModelError(f"model is a {type(model).__name__}: give a gaident.Model")
    if (model.p, model.q) != (p, q):
        raise ModelError(
            f"the model has p = {model.p}, q = {model.q}, but a {name} mechanism has p = {p}, "
            f"q = {q}: identify that structure, or let mechanics_from_model choose"
        )


def _checked(drive: Mechanics, positive: tuple[str, ...], not_negative: tuple[str, ...]) -> dict[str, object]:
    """The numbers of a drive as floats, and its deviations, by name."""
    found: dict[str, object] = {"std": dict(drive.std)}
    for name in positive + not_negative:
        unit = drive.UNITS[name]
        value = real_number(getattr(drive, name), name, ModelError, f"give one finite number in {unit}")
        found[name] = value
        # What an identification found is data, however odd: see `notes`.
        if drive.inconsistency is None and (value < 0.0 or (value == 0.0 and name in positive)):
            bound = "> 0" if name in positive else ">= 0"
            raise ModelError(f"{name} is {value:g}: give a number {bound} in {unit}")
        least = 1.0 / LARGEST if name in positive else 0.0
        if drive.inconsistency is None and not least <= value <= LARGEST:
            raise ModelError(f"{name} is {value:g}, which no drive has ({least:g} to {LARGEST:g}): give it in {unit}")
    return found


def _notes(drive: Mechanics, positive: tuple[str, ...], not_negative: tuple[str, ...], rounding: float) -> tuple[Text, ...]:
    found = []
    for name in positive + not_negative:
        value = getattr(drive, name)
        text = say("{} = {:.4g} {}", name, value, unit_text(drive.UNITS[name]))
        if name in positive and value <= 0.0:
            found.append(say("{} is not positive", text))
        elif name in not_negative and value < -max(POLICY.below_zero * drive.std.get(name, 0.0), rounding):
            found.append(say("{} is negative", text))
    return tuple(found)


def _checked_covariance(model: Model, covariance: ArrayLike | None) -> Matrix | None:
    if covariance is None:
        return None
    n = FactorCounts.of(model).size
    try:
        cov = floats(covariance)
    except TypeError:
        raise ModelError(f"covariance is {covariance!r:.80}: give {n} x {n} numbers, or None") from None
    if cov.shape != (n, n):
        raise ModelError(
            f"covariance has the shape {cov.shape}: this model has {n} natural parameters, "
            f"give {n} x {n} numbers in the order of factor_parameters(model)"
        )
    bad = np.argwhere(~np.isfinite(cov))
    if len(bad):
        i, j = (int(k) for k in bad[0])
        raise ModelError(
            f"covariance[{i}, {j}] is {cov[i, j]}: every entry must be finite; without a usable covariance give None"
        )
    if np.any(np.diag(cov) < 0.0) or not np.allclose(cov, cov.T, rtol=1e-6, atol=0.0):
        raise ModelError("covariance is not symmetric with a diagonal >= 0: give a covariance matrix")
    symmetric: Matrix = 0.5 * (cov + cov.T)
    return symmetric


def _root(value: float) -> float:
    return value**0.5 if value >= 0.0 else float("nan")
