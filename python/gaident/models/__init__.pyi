from . import effects
from .discrete import Discrete
from .effects import Effect
from .factors import FactorCounts, factor_parameters, model_from_factor_parameters
from .mechanics import Mechanics, OneMass, TwoMass, mechanics_from_dict, mechanics_from_model
from .model import Model
from .roots import Mode
from .search_space import SearchSpace
from .simulate import Run, initial_state, run, simulate
from .simulate_many import simulate_many, simulate_values
from .simulation_input import AnyModel

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
    "FactorCounts",
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
