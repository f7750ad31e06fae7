"""What an error depends on: the families of a short record."""

from __future__ import annotations

import numpy as np
import pytest

from gaident.diagnosis.selection.dependence import _strongest
from gaident.estimation.projection import project_out

RNG = np.random.default_rng(0)


def test_a_short_record_takes_of_a_family_what_holds_most_of_it_whatever_the_order() -> None:
    few = RNG.standard_normal((3, 200))
    family = RNG.standard_normal((9, 3)) @ few + 1e-3 * RNG.standard_normal((9, 200))
    kept = _strongest(family, 4)
    assert kept.shape == (4, 200)
    left = project_out(kept, family)
    assert np.abs(left).max() < 0.01, "nine functions that are three to a thousandth"
    # A function that stands last counts as much as one that stands first.
    other = _strongest(family[::-1], 4)
    np.testing.assert_allclose(project_out(kept, other), 0.0, atol=1e-6)
    cut = project_out(np.vstack([family[:2], family[:2]]), family)
    assert np.abs(cut).max() > 0.1
    sizes = np.geomspace(1e-6, 1e6, 9)[:, None]
    np.testing.assert_allclose(project_out(kept, _strongest(sizes * family, 4)), 0.0, atol=1e-6)


@pytest.mark.parametrize("room", [9, 30])
def test_where_there_is_room_a_family_stays_as_it_is(room: int) -> None:
    family = RNG.standard_normal((9, 200))
    np.testing.assert_array_equal(_strongest(family, room), family)
