"""A row of the page on accuracy."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Accuracy:
    """The largest error of a function over a domain."""

    function: str
    domain: str
    against: str
    unit: str
    error: float
    bound: float
    """What the error may be: asserted by the tests."""
