"""One function per peer and task, each in that package's own words. All work on a Fitness, which counts and may end the run.

bits_*: the paper's genetic algorithm on 194 bits (tournament of 2, two-point crossover 0.9, bit mutation 0.01), population 50.
numbers_*: what the package offers on six real numbers in 0..1; restarted with another seed when it stops by itself.
"""

from __future__ import annotations

import logging
import random
import warnings
from collections.abc import Callable

import numpy as np
from peer_problem import BITS, NUMBERS, Fitness

POPULATION = 50
FOREVER = 10**9


def _deap(seed: int) -> tuple:
    from deap import base, creator, tools

    if not hasattr(creator, "Least"):
        creator.create("Least", base.Fitness, weights=(-1.0,))
        creator.create("Candidate", list, fitness=creator.Least)
    random.seed(seed)
    return base.Toolbox(), creator.Candidate, tools


def _deap_evaluation(toolbox: object, fitness: Fitness) -> None:
    """DEAP evaluates through toolbox.map, so a whole generation can be one call."""
    toolbox.register("evaluate", lambda x: (fitness.one(np.array(x)),))
    if fitness.batched:
        toolbox.register("map", lambda _, people: [(f,) for f in fitness.many(np.array(list(people)))])


def bits_deap(fitness: Fitness, generations: int, seed: int) -> None:
    from deap import algorithms

    toolbox, candidate, tools = _deap(seed)
    toolbox.register("mate", tools.cxTwoPoint)
    toolbox.register("mutate", tools.mutFlipBit, indpb=0.01)
    toolbox.register("select", tools.selTournament, tournsize=2)
    _deap_evaluation(toolbox, fitness)
    people = [candidate(random.getrandbits(1) for _ in range(BITS)) for _ in range(POPULATION)]
    algorithms.eaSimple(people, toolbox, cxpb=0.9, mutpb=1.0, ngen=generations, verbose=False)


def numbers_deap(fitness: Fitness, seed: int) -> None:
    """An elitist GA, 50 + 50, simulated binary crossover and polynomial mutation, 500 generations a start."""
    from deap import algorithms

    toolbox, candidate, tools = _deap(seed)
    box = {"low": 0.0, "up": 1.0, "eta": 10.0}
    toolbox.register("mate", tools.cxSimulatedBinaryBounded, **box)
    toolbox.register("mutate", tools.mutPolynomialBounded, **box, indpb=1.0 / NUMBERS)
    toolbox.register("select", tools.selTournament, tournsize=3)
    _deap_evaluation(toolbox, fitness)
    people = [candidate(random.random() for _ in range(NUMBERS)) for _ in range(POPULATION)]
    algorithms.eaMuPlusLambda(people, toolbox, POPULATION, POPULATION, 0.6, 0.4, 500, verbose=False)


def _pygad(fitness: Fitness, generations: int, seed: int, **options: object) -> None:
    import pygad

    silent = logging.getLogger("pygad of the benchmark")  # it would log the exception that ends a run
    silent.setLevel(logging.CRITICAL + 1)

    def one(_: object, x: np.ndarray, __: object) -> float:
        return -fitness.one(np.asarray(x, dtype=float))

    def many(_: object, X: np.ndarray, __: object) -> list[float]:
        return [-f for f in fitness.many(np.asarray(X, dtype=float))]

    batch = {"fitness_func": many, "fitness_batch_size": POPULATION} if fitness.batched else {"fitness_func": one}
    pygad.GA(
        num_generations=generations,
        sol_per_pop=POPULATION,
        parent_selection_type="tournament",
        K_tournament=2,
        crossover_type="two_points",
        crossover_probability=0.9,
        mutation_type="random",
        random_seed=seed,
        suppress_warnings=True,
        logger=silent,
        **batch,
        **options,
    ).run()


def bits_pygad(fitness: Fitness, generations: int, seed: int) -> None:
    _pygad(
        fitness,
        generations,
        seed,
        num_parents_mating=POPULATION,
        num_genes=BITS,
        gene_type=int,
        gene_space=[0, 1],
        mutation_probability=0.01,
        keep_elitism=0,
        keep_parents=0,
    )


def numbers_pygad(fitness: Fitness, seed: int) -> None:
    """Its real-coded GA: one elite, steps of up to 0.05, 500 generations a start."""
    _pygad(
        fitness,
        500,
        seed,
        num_parents_mating=POPULATION // 2,
        num_genes=NUMBERS,
        init_range_low=0.0,
        init_range_high=1.0,
        gene_space={"low": 0.0, "high": 1.0},
        random_mutation_min_val=-0.05,
        random_mutation_max_val=0.05,
        mutation_probability=1.0 / NUMBERS,
    )


def _pymoo(fitness: Fitness, algorithm: object, variables: int, generations: int, seed: int) -> None:
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Box(Problem):
        def __init__(self) -> None:
            super().__init__(n_var=variables, n_obj=1, xl=0.0, xu=1.0)

        def _evaluate(self, X: np.ndarray, out: dict, *_: object, **__: object) -> None:
            out["F"] = fitness.many(np.asarray(X, dtype=float))

    minimize(Box(), algorithm, ("n_gen", generations), seed=seed, verbose=False, copy_algorithm=False)


def bits_pymoo(fitness: Fitness, generations: int, seed: int) -> None:
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.operators.crossover.pntx import TwoPointCrossover
    from pymoo.operators.mutation.bitflip import BitflipMutation
    from pymoo.operators.sampling.rnd import BinaryRandomSampling

    operators = {
        "sampling": BinaryRandomSampling(),
        "crossover": TwoPointCrossover(prob=0.9),
        "mutation": BitflipMutation(prob=1.0, prob_var=0.01),
    }
    _pymoo(fitness, GA(pop_size=POPULATION, eliminate_duplicates=False, **operators), BITS, generations, seed)


def numbers_pymoo(fitness: Fitness, seed: int) -> None:
    """Its differential evolution, 300 generations a start."""
    from pymoo.algorithms.soo.nonconvex.de import DE

    _pymoo(fitness, DE(pop_size=POPULATION, variant="DE/rand/1/bin", CR=0.9), NUMBERS, 300, seed)


class _Pygmo:
    """A pygmo problem; pygmo calls one candidate at a time."""

    def __init__(self, fitness: Fitness, variables: int, integers: bool) -> None:
        self.f, self.n, self.integers = fitness, variables, integers

    def fitness(self, x: np.ndarray) -> list[float]:
        return [self.f.one(x)]

    def get_bounds(self) -> tuple[list[float], list[float]]:
        return [0.0] * self.n, [1.0] * self.n

    def get_nix(self) -> int:
        return self.n if self.integers else 0

    def __deepcopy__(self, _: dict) -> _Pygmo:
        return self  # pygmo copies what it is given; the counts must stay in one place


def bits_pygmo(fitness: Fitness, generations: int, seed: int) -> None:
    import pygmo

    sga = pygmo.sga(gen=generations, cr=0.9, crossover="single", m=0.01, mutation="uniform", param_s=2, seed=seed)
    people = pygmo.population(pygmo.problem(_Pygmo(fitness, BITS, True)), POPULATION, seed=seed)
    pygmo.algorithm(sga).evolve(people)


def numbers_pygmo(fitness: Fitness, seed: int) -> None:
    """Self-adapting differential evolution (sade)."""
    import pygmo

    people = pygmo.population(pygmo.problem(_Pygmo(fitness, NUMBERS, False)), POPULATION, seed=seed)
    pygmo.algorithm(pygmo.sade(gen=10**6, seed=seed)).evolve(people)


def _scipy(fitness: Fitness, seed: int, generations: int, **options: object) -> None:
    from scipy.optimize import differential_evolution

    start = np.random.default_rng(seed).random((POPULATION, NUMBERS))
    batch = {"vectorized": True, "updating": "deferred"} if fitness.batched else {}
    call = (lambda X: fitness.many(np.atleast_2d(X.T))) if fitness.batched else fitness.one
    box = [(0.0, 1.0)] * NUMBERS
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        differential_evolution(call, box, init=start, maxiter=generations, polish=False, seed=seed, **batch, **options)


def generations_scipy(fitness: Fitness, generations: int, seed: int) -> None:
    _scipy(fitness, seed, generations, tol=0.0, atol=0.0)


def numbers_scipy(fitness: Fitness, seed: int) -> None:
    """differential_evolution with its default strategy (best1bin)."""
    _scipy(fitness, seed, FOREVER)


def generations_cma(fitness: Fitness, generations: int, seed: int) -> None:
    import cma

    start = np.random.default_rng(seed).random(NUMBERS)
    options = {"bounds": [0.0, 1.0], "popsize": POPULATION, "seed": seed + 1, "verbose": -9, "maxiter": generations}
    search = cma.CMAEvolutionStrategy(start, 0.3, options)
    for _ in range(generations):
        X = search.ask()
        search.tell(X, fitness.many(np.array(X)).tolist())


def numbers_cma(fitness: Fitness, seed: int) -> None:
    """CMA-ES with its own population, restarted in turns of small and large populations (BIPOP)."""
    import cma

    draw = np.random.default_rng(seed)
    options = {"bounds": [0.0, 1.0], "seed": seed + 1, "verbose": -9, "verb_log": 0}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cma.fmin2(fitness.one, lambda: draw.random(NUMBERS), 0.3, options, restarts=9, bipop=True)


PER_GENERATION: dict[str, Callable[[Fitness, int, int], None]] = {
    "DEAP": bits_deap,
    "PyGAD": bits_pygad,
    "pymoo": bits_pymoo,
    "pygmo": bits_pygmo,
    "SciPy differential evolution": generations_scipy,
    "CMA-ES": generations_cma,
}
ON_NUMBERS: dict[str, Callable[[Fitness, int], None]] = {
    "DEAP": numbers_deap,
    "PyGAD": numbers_pygad,
    "pymoo": numbers_pymoo,
    "pygmo": numbers_pygmo,
    "SciPy differential evolution": numbers_scipy,
    "CMA-ES": numbers_cma,
}
