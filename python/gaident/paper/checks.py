"""What follows from the paper's own numbers, without any data: Tables III to V against one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.identification.plant_of_discrete import plant_of_discrete
from gaident.models import two_mass
from gaident.models.factors import FactorCounts, factor_parameters
from gaident.models.mechanics import OneMass, TwoMass, mechanics_from_model
from gaident.models.model import Model
from gaident.paper.facts import DT, Mechanism

__all__ = ["IdentifiedMechanics", "NominalCheck", "TableV", "identified_mechanics", "nominal_check", "table_v"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class NominalCheck:
    """Table III's sheet values as factor modules against the nominal column of Table IV; deviations are relative."""

    model: Model
    rows: tuple[tuple[str, complex, complex, float], ...]  # name, from Table III, printed, deviation

    @property
    def worst(self) -> float:
        """The largest deviation."""
        return max(row[3] for row in self.rows)


def nominal_check(mechanism: Mechanism) -> NominalCheck:
    """K, A and B of the sheet values by equations (4) and (5); the modulus of a pair's deviation is relative to its own."""
    model, printed = mechanism.sheet.model(), mechanism.nominal
    rows: list[tuple[str, complex, complex, float]] = [
        ("K", model.gain, printed.gain, abs(model.gain / printed.gain - 1.0)),
    ]
    for letter, ours, theirs in (("A", model.poles, printed.poles), ("B", model.zeros, printed.zeros)):
        for root, other in zip(ours, theirs, strict=True):
            if root.imag >= 0.0:
                name = f"{letter}11" if root.imag == 0.0 else f"{letter}21,22"
                rows.append((name, -root.conjugate(), -other.conjugate(), abs(root - other) / abs(other)))
    return NominalCheck(model, tuple(rows))


@dataclass(frozen=True)
class IdentifiedMechanics:
    """The mechanics behind Table IV's identified column. For one mass there is one way, `product`.

    product: K_G from prod A, the paper's way; pairwise: K_G from the sum of pairwise products; least_squares: in between, with
    `inconsistency` = abs(1 - K_G product/K_G pairwise); shaft: D_G free, which meets all six numbers.
    """

    product: OneMass | TwoMass
    pairwise: TwoMass | None = None
    least_squares: TwoMass | None = None
    shaft: TwoMass | None = None


def identified_mechanics(mechanism: Mechanism) -> IdentifiedMechanics:
    """The six numbers K, A, B over-determine five mechanical parameters at D_G = 0."""
    model = mechanism.identified
    found = mechanics_from_model(model)
    if not isinstance(found, TwoMass):
        return IdentifiedMechanics(OneMass.from_model(model))
    c = two_mass.coefficients_of_parameters(factor_parameters(model)[1], FactorCounts.of(model))
    product, pairwise = (_mechanism(way(c)) for way in (two_mass.phi_by_product, two_mass.phi_by_pairwise))
    return IdentifiedMechanics(product, pairwise, found, found.with_shaft_damping)


def _mechanism(phi: Vector) -> TwoMass:
    JM, DM, JL, DL, KG, _ = (float(value) for value in two_mass.mechanics_of_phi(phi))
    return TwoMass(JM, DM, JL, DL, KG)


@dataclass(frozen=True)
class TableV:
    """Table V's proposed column from Table IV's identified model, with the loop-gain factor and with the printed gains.

    worst: largest deviation of `scaled` from the printed column, relative to its largest coefficient; the same for
    `with_printed_gains`. conventional_apart: how far the paper's own two columns are from each other, in the same measure, and
    `conventional`: the mechanics behind its least-squares column, where there is a plant behind it.
    """

    scaled: Vector
    with_printed_gains: Vector
    printed: Vector
    printed_conventional: Vector
    conventional: OneMass | TwoMass | None

    @property
    def worst(self) -> float:
        return self._apart(self.scaled)

    @property
    def worst_with_printed_gains(self) -> float:
        return self._apart(self.with_printed_gains)

    @property
    def conventional_apart(self) -> float:
        return self._apart(self.printed_conventional)

    def _apart(self, values: Vector) -> float:
        return float(np.max(np.abs(values - self.printed)) / np.max(np.abs(self.printed)))


def table_v(mechanism: Mechanism) -> TableV:
    """alpha_0..alpha_N, beta_1..beta_N of equation (7), by `Model.discrete`."""
    scaled, printed_gains = (
        mechanism.identified.discrete(DT, controller) for controller in (mechanism.scaled_controller(), mechanism.controller())
    )
    alpha, beta = (np.array(values) for values in mechanism.conventional)
    plant = plant_of_discrete(alpha, beta, DT, mechanism.scaled_controller()).model
    return TableV(
        np.r_[scaled.alpha, scaled.beta],
        np.r_[printed_gains.alpha, printed_gains.beta],
        np.concatenate(mechanism.proposed),
        np.r_[alpha, beta],
        None if plant is None else mechanics_from_model(plant),
    )
