"""Faults: what is wrong, where, and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Fault", "GraphError", "GraphWarning", "NoAdapterError", "Place"]


@dataclass(frozen=True)
class Place:
    """Where a fault lies in a graph, a shader or a scene file. Lines and columns count from 1."""

    path: str
    line: int
    column: int
    end_line: int
    end_column: int
    source: str
    """The text at this place."""
    label: str
    """A word on it; may be empty."""


@dataclass(frozen=True)
class Fault:
    """One fault. As a text it has the lines of its places, with carets under them."""

    severity: str
    """`"error"`, `"warning"` or `"note"`."""
    message: str
    """What is wrong, in one sentence."""
    places: tuple[Place, ...]
    """The first is the main one."""
    help: tuple[str, ...]
    """Remedies."""
    text: str
    """All of it, as a terminal shows it."""

    def __str__(self) -> str:
        return self.text.rstrip()


class GraphError(Exception):
    """What a graph, a scene, a parameter or the device can't do, with every fault that was found."""

    def __init__(self, text: str, faults: Sequence[Fault] = ()) -> None:
        super().__init__(text, tuple(faults))

    @property
    def faults(self) -> tuple[Fault, ...]:
        """All faults, each with its places and remedies."""
        return self.args[1]

    def __str__(self) -> str:
        return str(self.args[0]).rstrip()


class NoAdapterError(GraphError):
    """The machine has no Vulkan or Metal adapter that fits."""


class GraphWarning(UserWarning):
    """Something went on, but probably not as meant."""
