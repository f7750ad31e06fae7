"""The position controller of a servo axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from gaident.checks import real_number
from gaident.control.drive_parameters import position_gain
from gaident.errors import ControllerError

__all__ = ["P"]


@dataclass(frozen=True)
class P:
    """Proportional position controller: velocity command = gain (position command - position).

    Parameters
    ----------
    gain : float
        Kv [1/s], > 0; None: not known, and estimated by `identify` and `diagnose` where the torque is logged.

    Raises
    ------
    ControllerError
        For a gain that is not above 0.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.P(40.0)
    P(gain=40.0)
    """

    gain: float

    if TYPE_CHECKING:

        def __init__(self, gain: float | None) -> None: ...

    def __post_init__(self) -> None:
        if self.gain is None:
            return
        gain = real_number(self.gain, "gain", ControllerError)
        if gain <= 0.0:
            raise ControllerError(f"gain is {gain:g}: give a number > 0 [1/s]")
        object.__setattr__(self, "gain", gain)

    @classmethod
    def from_drive(cls, drive: str, **parameters: float) -> P:
        """Return the position controller of a gain as a drive shows it.

        Parameters
        ----------
        drive : str
            "el72xx", "ax5000", "ax8000", "odrive" or "simplefoc".
        **parameters : float
            The drive's parameter in the drive's unit; see the guide "Where to find it in your drive".

        Returns
        -------
        P
            With the gain Kv [1/s].

        Raises
        ------
        ControllerError
            For a drive whose position gain is not known, and a parameter that is missing, of another drive or not above 0.

        Examples
        --------
        >>> import gaident as ga
        >>> ga.P.from_drive("ax5000", s_0_0104=1.5)
        P(gain=25.0)
        """
        return cls(position_gain(drive, parameters))
