"""One or two arguments of the public functions at once, with drawn values: one error of one line, no warning, no other end."""

from __future__ import annotations

import os
import time
import warnings
from pathlib import Path

import hypothesis
import pytest
from hostile_calls import CALLS, SECONDS, TAKEN, arguments_of
from hostile_values import HOSTILE, OwnError, near
from hypothesis import HealthCheck
from hypothesis import strategies as st

import gaident as ga
from gaident.models.own_effects import OWN

# HYPOTHESIS_PROFILE=search tries others in each run, and GAIDENT_EXAMPLES says how many of each function.
EXAMPLES = int(os.environ.get("GAIDENT_EXAMPLES", "25"))


def changed(draw: st.DrawFn, name: str) -> dict[str, object]:
    """Hostile values for one or two of the arguments, each drawn freely or near the one that the row has."""
    given, names = CALLS[name][1], arguments_of(name)
    chosen = draw(st.lists(st.sampled_from(names), min_size=1, max_size=min(2, len(names)), unique=True))
    values = {n: draw(near(given[n]) if n in given and draw(st.booleans()) else HOSTILE) for n in chosen}
    return {n: v for n, v in values.items() if not (callable(v) and (name, n) in TAKEN)}


def fault_of(name: str, values: dict[str, object]) -> str:
    """Call the function; "" or what is wrong with its error. Other exceptions, a warning among them, go through."""
    function, given = CALLS[name]
    began = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            function(**{**given, **values})
    except (ga.GaidentError, OSError) as error:
        if len(said := str(error).strip().splitlines()) != 1:
            return f"{len(said)} lines: {error}"
    except OwnError:
        pass
    finally:
        for own in tuple(OWN):
            ga.effects.unregister(own)
    took = time.process_time() - began
    return f"{took:.1f} s" if took > SECONDS else ""


@pytest.mark.long
@pytest.mark.parametrize("name", [n for n in CALLS if arguments_of(n)])
def test_drawn_arguments_end_in_one_error_that_is_ours(name: str, files: Path) -> None:
    @hypothesis.settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
    @hypothesis.given(st.data())
    def drawn(data: st.DataObject) -> None:
        values = changed(data.draw, name)
        assert not fault_of(name, values)

    drawn()
