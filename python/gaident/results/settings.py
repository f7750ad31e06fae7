"""What a genetic run is told."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from gaident.checks import is_whole, known_keys
from gaident.errors import SettingsError

if TYPE_CHECKING:
    from gaident import _core

__all__ = ["Settings"]

ENGINES = {
    "species": "one species per (p, q), local fits, structures compared afterwards by whitened BIC (the default)",
    "plain": "one population, every structure in it, fitness (6) alone decides (the paper)",
}
CODES = ("gray", "binary")
SCALES = ("logarithmic", "linear")
# A drive's: genes, coefficients, recurrence and fitness in them. See docs/dsp.md.
DRIVE_ARITHMETICS = ("drive_double", "drive_float", "c30", "fixed", "fixed_tight", "fixed_wide")
ARITHMETICS = ("double", "float", *DRIVE_ARITHMETICS)
INITIAL_STATES = ("auto", "rest", "free")


@dataclass(frozen=True)
class Settings:
    """Settings of the genetic search; `Settings()` is the best engine, `Settings.paper()` is exactly Table II.

    Parameters
    ----------
    population : int
        Individuals in all; the species engine keeps at least three per structure.
    tournament : int
        Individuals that compete in a selection.
    crossover : float
        Rate of crossover per pair [1].
    mutation : float
        Rate of mutation per bit [1].
    generations : int
        Generations of the plain engine; at most so many of the species engine.
    elites : int
        Survivors of the plain engine (species always keep one each).
    code : {"gray", "binary"}
        Code of a number.
    scale : {"logarithmic", "linear"}
        Scale of real and imaginary parts (K is always logarithmic).
    error_weight : float
        Weight Wf1 of the error in fitness (6).
    order_weight : float
        Weight Wf2 of the order in fitness (6).
    engine : {"species", "plain"}
        "species": a species per structure (p, q), local fits, structures compared afterwards by whitened BIC.
        "plain": one population with every structure in it; fitness (6) alone decides, as in the paper.
    round : int
        Generations after which the species engine fits every species' best locally.
    quiet_rounds : int
        Rounds without a better optimum close to the best, after which the species engine stops.
    arithmetic : str
        Arithmetic of the genetic search, "double" or "float"; local fits are always double.
        Or that of a drive (docs/dsp.md), in which the run is the drive's bit for bit: "drive_double", "drive_float" (64 and 32
        bits throughout), "c30" (the paper's processor), "fixed" (32-bit fixed point; "fixed_tight", "fixed_wide": less and more
        headroom). Those know the continuous loop without limits.
    initial_state : {"auto", "rest", "free"}
        "free": estimated for every record. "auto": estimated for records that do not start at rest.

    Raises
    ------
    SettingsError
        For a value out of its range; names the field, the value and what it may be.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.Settings(population=80).species, ga.Settings.paper().code
    (True, 'binary')
    """

    population: int = 50
    tournament: int = 2
    crossover: float = 0.9
    mutation: float = 0.01
    generations: int = 1000
    elites: int = 0
    code: str = "gray"
    scale: str = "logarithmic"
    error_weight: float = 1.0
    order_weight: float = 2.0
    engine: str = "species"
    round: int = 40
    quiet_rounds: int = 1
    arithmetic: str = "double"
    initial_state: str = "auto"

    def __post_init__(self) -> None:
        for name, low, top in (
            ("population", 2, 1_000_000),
            ("tournament", 1, "population"),
            ("generations", 1, 10_000_000),
            ("elites", 0, "population - 1"),
            ("round", 1, 10_000_000),
            ("quiet_rounds", 1, 10_000_000),
        ):
            value = getattr(self, name)
            if not is_whole(value):
                raise SettingsError(f"{name} is {value!r}: it must be a whole number, {low} or more")
            high = top if isinstance(top, int) else self.population - (name == "elites")
            if not low <= int(value) <= high:
                raise SettingsError(f"{name} is {value!r}: it must be a whole number from {low} to {high}")
            object.__setattr__(self, name, int(value))
        for name in ("crossover", "mutation"):
            value = getattr(self, name)
            if not isinstance(value, (int, float)) or not 0.0 <= value <= 1.0:
                raise SettingsError(f"{name} is {value!r}: it is a probability, from 0 to 1")
        if 0.0 < self.mutation < 1e-6:  # no decision: what an argument may be
            raise SettingsError(f"mutation is {self.mutation!r}: rates below 1e-6 never flip a bit; use 0 to have none")
        for name in ("error_weight", "order_weight"):
            value = getattr(self, name)
            if not isinstance(value, (int, float)) or not 0.0 <= value < float("inf"):
                raise SettingsError(f"{name} is {value!r}: it must be a number, 0 or more")
        for name, allowed in (
            ("engine", tuple(ENGINES)),
            ("code", CODES),
            ("scale", SCALES),
            ("arithmetic", ARITHMETICS),
            ("initial_state", INITIAL_STATES),
        ):
            value = getattr(self, name)
            if not isinstance(value, str) or value not in allowed:
                raise SettingsError(f"{name} is {value!r}: it must be one of {', '.join(map(repr, allowed))}")

    @classmethod
    def paper(cls) -> Settings:
        """Return the settings of Table II of the paper.

        Population 50, tournament, multi-point crossover 0.9, bit mutation 0.01, binary code, 1000 generations, Wf1 = 1, Wf2 = 2.
        No elitism; the best candidate ever seen is reported, without a local fit.
        """
        return cls(code="binary", scale="linear", engine="plain")

    @property
    def in_drive(self) -> bool:
        """Whether the search runs in a drive's arithmetic."""
        return self.arithmetic in DRIVE_ARITHMETICS

    @property
    def species(self) -> bool:
        """Whether structures are protected in species of their own."""
        return self.engine == "species"

    def engine_settings(self) -> _core.EngineSettings:
        """Return the same for the core."""
        from gaident import _core

        return _core.EngineSettings(
            population=self.population,
            tournament=self.tournament,
            crossover=self.crossover,
            mutation=self.mutation,
            generations=self.generations,
            elites=self.elites,
            gray=self.code == "gray",
            logarithmic=self.scale == "logarithmic",
            error_weight=self.error_weight,
            order_weight=self.order_weight,
            species=self.species,
            round=self.round,
            quiet_rounds=self.quiet_rounds,
            in_float=self.arithmetic == "float",
            mirror=self.arithmetic if self.in_drive else "",
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Settings:
        """Return the settings of what `to_dict` gave; raise SettingsError for unknown keys."""
        values: dict[str, Any] = known_keys(data, "the dictionary of settings", [f.name for f in fields(cls)], (), SettingsError)
        return cls(**values)
