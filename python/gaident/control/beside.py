"""What a controller has beside kp and ki, in words."""

from __future__ import annotations

from gaident.control.cascade import FEEDFORWARDS, FILTERS, cascade_of
from gaident.control.controller import Controller

__all__ = ["beside_pi"]


def beside_pi(controller: Controller) -> str:
    """ "the backward rule and a torque limit": all that a controller has beside kp and ki; "" for nothing."""
    cascade = cascade_of(controller)
    pi = cascade.velocity
    has = [f"the {pi.rule} rule"] if pi.rule != "trapezoidal" else []
    has += ["a command weight"] if pi.command_weight != 1.0 else []
    has += [f"{_article(name)} {_words(name)}" for name in ("torque_limit", "integrator_limit") if getattr(pi, name) is not None]
    has += ["an anti-windup"] if pi.anti_windup != "none" else []
    has += ["a position controller"] if cascade.position is not None else []
    has += [f"{_article(name)} {_words(name)}" for name in FEEDFORWARDS if getattr(cascade, name) != 0.0]
    for name in FILTERS:
        count, one = len(getattr(cascade, name)), _words(name).removesuffix("s")
        has += [] if not count else [f"a {one}"] if count == 1 else [f"{count} {one}s"]
    has += ["a delay"] if cascade.delay != 0.0 else []
    return " and ".join(part for part in (", ".join(has[:-1]), *has[-1:]) if part)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _article(name: str) -> str:
    return "an" if name[0] in "aeiou" else "a"
