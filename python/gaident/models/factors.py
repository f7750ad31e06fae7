"""The natural parameters of a model: one vector of real numbers, smooth where roots merge.

    x = (gain, a of each real pole (s + a), e1 and e0 of each pole pair (s^2 + e1 s + e0), the same for zeros)

in the order in which Model keeps its roots. Covariances of a model are written over this vector.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.data.signals.arrays import floats
from gaident.errors import ModelError
from gaident.models.effect_rows import SIDES
from gaident.models.model import Model
from gaident.models.roots import check_sizes, quadratic_roots


class FactorCounts(NamedTuple):
    """How many real roots and conjugate pairs a model has.

    Attributes
    ----------
    real_poles : int
        Real poles.
    pole_pairs : int
        Pairs of poles.
    real_zeros : int
        Real zeros.
    zero_pairs : int
        Pairs of zeros.

    Examples
    --------
    >>> import gaident as ga
    >>> from gaident.models import FactorCounts
    >>> FactorCounts.of(ga.TwoMass(JM=1e-4, DM=0.003, JL=6e-4, DL=0.008, KG=2.6).model())
    FactorCounts(real_poles=1, pole_pairs=1, real_zeros=0, zero_pairs=1)
    """

    real_poles: int
    pole_pairs: int
    real_zeros: int
    zero_pairs: int

    @classmethod
    def of(cls, model: Model) -> FactorCounts:
        """Return the structure of a model."""
        pole_pairs = sum(r.imag > 0.0 for r in model.poles)
        zero_pairs = sum(r.imag > 0.0 for r in model.zeros)
        return cls(len(model.poles) - 2 * pole_pairs, pole_pairs, len(model.zeros) - 2 * zero_pairs, zero_pairs)

    @property
    def size(self) -> int:
        """Number n of natural parameters."""
        return 1 + self.real_poles + 2 * self.pole_pairs + self.real_zeros + 2 * self.zero_pairs

    @property
    def p(self) -> int:
        """Poles in excess of zeros."""
        return self.real_poles + 2 * self.pole_pairs - self.q

    @property
    def q(self) -> int:
        """Number of zeros."""
        return self.real_zeros + 2 * self.zero_pairs


def factor_parameters(model: Model) -> tuple[tuple[str, ...], NDArray[np.float64], tuple[str, ...]]:
    """Return the natural parameters of a model with their names and units; smooth where roots merge.

        x = (gain, a of each real pole (s + a), e1 and e0 of each pole pair (s^2 + e1 s + e0), the same for zeros)

    Parameters
    ----------
    model : Model
        The model; its effects are left out.

    Returns
    -------
    names : tuple of str
        "gain", "pole_1", "pole_pair_1_e1", "pole_pair_1_e0", "zero_1", "zero_pair_1_e1", ...; counted from 1 within their kind.
    values : ndarray, shape (n,)
        The vector x. Note the sign: the value of "pole_1" is a = -pole, the paper's A.
    units : tuple of str
        The unit of each value.

    Examples
    --------
    >>> import gaident as ga
    >>> names, values, units = ga.factor_parameters(ga.Model(500.0, [-5.0]))
    >>> list(zip(names, values.tolist(), units))
    [('gain', 500.0, 'rad/s^2/(N m)'), ('pole_1', 5.0, 'rad/s')]
    """
    if not all(hasattr(model, name) for name in ("gain", "poles", "zeros", "p")):
        raise ModelError(f"model is a {type(model).__name__}: give a gaident.Model")
    for kind, roots in (("poles", model.poles), ("zeros", model.zeros)):
        if not isinstance(roots, Sequence | np.ndarray):
            raise ModelError(f"{kind} of model is {roots!r:.80}: give a gaident.Model")
        check_sizes(roots, f"{kind} of model")
    names, values, units = ["gain"], [model.gain], [gain_unit(model.p)]
    for kind, roots in (("pole", model.poles), ("zero", model.zeros)):
        for i, root in enumerate((r for r in roots if r.imag == 0.0), start=1):
            names.append(f"{kind}_{i}")
            values.append(-root.real)
            units.append("rad/s")
        for i, root in enumerate((r for r in roots if r.imag > 0.0), start=1):
            names += [f"{kind}_pair_{i}_e1", f"{kind}_pair_{i}_e0"]
            values += [-2.0 * root.real, root.real**2 + root.imag**2]
            units += ["rad/s", "rad^2/s^2"]
    return tuple(names), np.array(values, dtype=np.float64), tuple(units)


def model_from_factor_parameters(values: ArrayLike, structure: FactorCounts) -> Model:
    """Return the model of natural parameters; the inverse of `factor_parameters`.

    A pair with e1^2 >= 4 e0 has two real roots: the model then has another structure than the one given.

    Parameters
    ----------
    values : array_like, shape (n,)
        The vector x in the order and units of `factor_parameters`.
    structure : gaident.models.FactorCounts
        How many real roots and pairs the model has.

    Returns
    -------
    Model
        The model, without effects.

    Raises
    ------
    ModelError
        For a vector of the wrong length, a value that is not finite, and one that no drive has, see `Model`.

    Examples
    --------
    >>> import gaident as ga
    >>> from gaident.models import FactorCounts
    >>> model = ga.Model(500.0, [-5.0])
    >>> names, values, units = ga.factor_parameters(model)
    >>> ga.model_from_factor_parameters(values, FactorCounts.of(model))
    Model(gain=500.0, poles=[-5.0], zeros=[])
    """
    structure = _counts(structure)
    try:
        x = floats(values)
    except TypeError:
        raise ModelError(f"values is {values!r:.80}: give {structure.size} numbers, as factor_parameters does") from None
    if x.shape != (structure.size,):
        raise ModelError(f"values has the shape {x.shape}: {structure} takes {structure.size} numbers")
    if not np.all(np.isfinite(x)):
        i = int(np.flatnonzero(~np.isfinite(x))[0])
        raise ModelError(f"values[{i}] is {x[i]}: every parameter must be finite")
    poles_end = 1 + structure.real_poles + 2 * structure.pole_pairs
    poles = _roots(x[1:poles_end], structure.real_poles)
    zeros = _roots(x[poles_end:], structure.real_zeros)
    return Model(float(x[0]), poles, zeros)


def _counts(structure: object) -> FactorCounts:
    """How many roots of each kind, checked; raises ModelError."""
    numbers = structure if isinstance(structure, tuple) else ()
    whole = all(isinstance(n, int) and not isinstance(n, bool) and n >= 0 for n in numbers)
    if len(numbers) != len(FactorCounts._fields) or not whole:
        raise ModelError(f"structure is {structure!r:.80}: give gaident.models.FactorCounts, four whole numbers from 0 on")
    return FactorCounts(*numbers)


def model_numbers(model: Model) -> NDArray[np.float64]:
    """The natural parameters of a model, then the parameters of each of its effects, in their order."""
    return np.concatenate([factor_parameters(model)[1], *(np.array(effect.values) for effect in model.effects)])


def model_of_numbers(values: NDArray[np.float64], like: Model) -> Model:
    """The model with these `model_numbers`, and the structure and the effects of `like`; ModelError where none has them."""
    structure = FactorCounts.of(like)
    model, at = model_from_factor_parameters(values[: structure.size], structure), structure.size
    for effect in like.effects:
        parameters = dict(zip(effect.parameters, map(float, values[at : at + len(effect.values)]), strict=True))
        model = model.with_effect(effect.name, side=effect.side or SIDES[0], **parameters)
        at += len(effect.values)
    return model


def gain_unit(p: int) -> str:
    """Unit of the gain of a model with p poles in excess: (rad/s)^p rad/s per N m."""
    return "rad/s/(N m)" if p == 0 else f"rad/s^{p + 1}/(N m)"


def _roots(x: NDArray[np.float64], reals: int) -> Sequence[complex]:
    roots = [complex(-a, 0.0) for a in x[:reals]]
    for e1, e0 in x[reals:].reshape(-1, 2):
        roots += quadratic_roots(float(e1), float(e0))
    return roots
