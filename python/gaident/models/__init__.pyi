from . import effects
from .effects import Effect
from .factors import Structure, factor_parameters, model_from_factor_parameters
from .mechanics import Mechanics, OneMass, TwoMass, mechanics_from_dict, mechanics_from_model
from .model import Discrete, Mode, Model
from .search_space import SearchSpace
from .simulate import AnyModel, Run, initial_state, run, simulate, simulate_many, simulate_values

__all__ = [
    "AnyModel",
    "Discrete",
    "Effect",
    "Mechanics",
    "Mode",
    "Model",
    "OneMass",
    "Run",
    "SearchSpace",
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
