"""Tables of feedforward as one C99 file without dependencies but math.h."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from gaident.axis import said, say, unit

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["c_tables"]

Vector = NDArray[np.float64]


class _OneWave(Protocol):
    @property
    def order(self) -> float: ...
    @property
    def sine(self) -> float: ...
    @property
    def cosine(self) -> float: ...


class _Numbers(Protocol):
    """What is written: the numbers of `FeedforwardTables`."""

    @property
    def velocity(self) -> Vector: ...
    @property
    def friction(self) -> Vector: ...
    @property
    def viscous(self) -> float: ...
    @property
    def constant(self) -> float: ...
    @property
    def inertia(self) -> float: ...
    @property
    def waves(self) -> Sequence[_OneWave]: ...
    @property
    def axis(self) -> str: ...


TEXT = """\
/* {title}, written by gaident.
   {name}(velocity [{speed}], angle [{turn}], acceleration [{slope}]) is the {what} to add [{unit}]. */
#include <math.h>
#include <stddef.h>

static const double {name}_velocity[{count}] = {{{velocity}}};
static const double {name}_friction[{count}] = {{{friction}}};
{waves}
double {name}(double velocity, double angle, double acceleration);

double {name}(double velocity, double angle, double acceleration)
{{
    const double *w = {name}_velocity, *f = {name}_friction;
    double torque = {constant} + {viscous} * velocity + {of_slope} * acceleration;
    size_t i = 0;
    if (velocity <= w[0]) torque += f[0];
    else if (velocity >= w[{last}]) torque += f[{last}];
    else {{
        while (velocity > w[i + 1]) ++i;
        torque += f[i] + (f[i + 1] - f[i]) * (velocity - w[i]) / (w[i + 1] - w[i]);
    }}
{of_angle}
    return torque;
}}
"""
WAVES = """\
static const double {name}_waves[{count}][3] = {{{waves}}}; /* order, sine, cosine */
"""
OF_ANGLE = """\
    for (i = 0; i < {count}; ++i) {{
        const double x = {name}_waves[i][0] * angle;
        torque += {name}_waves[i][1] * sin(x) + {name}_waves[i][2] * cos(x);
    }}"""
NO_ANGLE = "    (void)angle; /* nothing depends on it */"


def c_tables(tables: _Numbers, name: str) -> str:
    """The text of the file; name: of the function."""
    axis, middle = tables.axis, len(tables.velocity) // 2
    velocity = np.concatenate([tables.velocity[:middle], [0.0], tables.velocity[middle:]])
    friction = np.concatenate([tables.friction[:middle], [0.0], tables.friction[middle:]])
    waves = [f"{{{_list((w.order, w.sine, w.cosine))}}}" for w in tables.waves]
    listed = {"name": name, "count": len(waves), "waves": ", ".join(waves)}
    return TEXT.format(
        title=said(say("{Torque} of friction, load and {inertia}"), axis),
        name=name,
        speed=unit("rad/s", axis),
        turn=unit("rad", axis),
        slope=unit("rad/s^2", axis),
        what=said(say("{torque}"), axis),
        unit=unit("N m", axis),
        count=len(velocity),
        last=len(velocity) - 1,
        velocity=_list(velocity),
        friction=_list(friction),
        waves=WAVES.format(**listed) if waves else "",
        of_angle=OF_ANGLE.format(**listed) if waves else NO_ANGLE,
        constant=repr(float(tables.constant)),
        viscous=repr(float(tables.viscous)),
        of_slope=repr(float(tables.inertia)),
    )


def _list(values: Iterable[float]) -> str:
    return ", ".join(repr(float(value)) for value in values)
