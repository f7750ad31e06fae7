"""Models of drives: factored transfer function, one and two masses, the controller, and their simulation."""

from __future__ import annotations

from gaident.models import effects
from gaident.models.controller import PI
from gaident.models.effects import Effect
from gaident.models.factors import Structure, factor_parameters, model_from_factor_parameters
from gaident.models.mechanics import Mechanics, OneMass, TwoMass, mechanics_from_dict, mechanics_from_model
from gaident.models.model import Discrete, Mode, Model
from gaident.models.simulate import AnyModel, Run, initial_state, run, simulate, simulate_many, simulate_values

__all__ = [
    "AnyModel",
    "Discrete",
    "Effect",
    "Mechanics",
    "Mode",
    "Model",
    "OneMass",
    "PI",
    "Run",
    "Structure",
    "TwoMass",
    "effects",
    "factor_parameters",
    "initial_state",
    "mechanics_from_dict",
    "mechanics_from_model",
    "model_from_factor_parameters",
    "run",
    "simulate",
    "simulate_many",
    "simulate_values",
]
