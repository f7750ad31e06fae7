"""Messages of work under way, which a narrow line shows in short."""

from __future__ import annotations

__all__ = ["Message", "shortest"]


class Message(str):
    """A message, and the same for a line that is too short for it."""

    short: str

    def __new__(cls, text: str, short: str | None = None) -> Message:
        """text: the message; short: the same in fewer letters, None for none."""
        message = super().__new__(cls, text)
        message.short = str(text) if short is None else short
        return message


def shortest(message: str) -> str:
    """The short form of a message that has one, else the message."""
    return message.short if isinstance(message, Message) else message
