"""What can be wrong with measurements. This package knows no part of `technic`, so it has its own errors."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["DataError", "FitError"]


class DataError(ValueError):
    """The data or a description of a rig cannot be used; `faults` has one message per fault."""

    def __init__(self, faults: Sequence[str]) -> None:
        self.faults = tuple(faults)
        super().__init__("; ".join(self.faults))


class FitError(ValueError):
    """The readings contradict each other or the model of the rig."""
