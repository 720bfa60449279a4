"""[[shells]] of a scene file: what reflected rays meet, split front to back into maps of their own."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field

from mirrorbake import _core
from mirrorbake.proxy import FAMILIES
from mirrorbake.scene.config_values import Section, as_tuple, one_of

ITSELF = "itself"
"""Name of the reflector among the objects of a shell."""

ENCLOSING = "enclosing ellipsoid"
"""The smallest about each part, for `itself` alone."""

ShellShape: TypeAlias = Annotated[str, one_of("auto", "plane", *FAMILIES, ENCLOSING)]
"""Geometry of a shell; "auto" fits what its rays meet, for each part apart for `itself`."""


class ShellRule(Section):
    """What of a reflected ray a shell holds: what it meets first, where it is of this kind."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=100)]
    """Letters, digits, `_` and `-`."""
    objects: Annotated[
        tuple[Annotated[str, Field(min_length=1, max_length=1000)], ...], BeforeValidator(as_tuple)
    ] = ()
    """Names of objects that it holds, `*` for any letters; `itself` is the reflector. None: all."""
    nearer_than: Annotated[float, Field(gt=0, le=1e12)] | None = None
    """Holds only what reflected rays meet within so many metres."""

    @property
    def is_itself(self) -> bool:
        """Whether it holds nothing but what the object reflects of itself."""
        return self.objects == (ITSELF,)

    @property
    def limits(self) -> dict[str, Any]:
        """What tells which places of its things it holds: arguments of `_core.ShellRule`."""
        keys = ShellRule.model_fields.keys() - {"name", "objects"}
        return {key: value for key in sorted(keys) if (value := getattr(self, key)) is not None}

    @property
    def takes_rest(self) -> bool:
        """Whether it holds whatever it gets."""
        return not self.objects and not self.limits


class ShellSection(ShellRule):
    """[[shells]]: one shell, nearer than those after it."""

    proxy: ShellShape = "auto"

    @property
    def rule(self) -> ShellRule:
        """What it holds, whatever it lies on."""
        return ShellRule(**{key: getattr(self, key) for key in ShellRule.model_fields})


Shells: TypeAlias = tuple[ShellSection, ...]

DEFAULT_SHELLS: Shells = (ShellSection(name="local", objects=(ITSELF,)), ShellSection(name="distant"))
"""[PEM] §4: what the object reflects of itself, and the rest."""


def check_shells(shells: Shells) -> None:
    """Raise ValueError for a list of shells that is none."""
    if not 1 <= len(shells) <= _core.MOST_SHELLS:
        raise ValueError(f"shells: {len(shells)} of them; expected 1 to {_core.MOST_SHELLS}")
    names = [shell.name for shell in shells]
    for shell in shells[:-1]:
        if names.count(shell.name) > 1:
            raise ValueError(f"shells: two are named {shell.name!r}")
        if shell.takes_rest:
            raise ValueError(
                f"shells: {shell.name!r} takes the rest, so that nothing is left for others; expected it last"
            )
    if not shells[-1].takes_rest:
        raise ValueError(
            f"shells: the last, {shells[-1].name!r}, holds some things alone; expected one that takes the "
            "rest, without `objects` and `nearer_than`"
        )
    for shell in shells:
        if shell.proxy == ENCLOSING and not shell.is_itself:
            raise ValueError(
                f"shells: {shell.name!r}: proxy = {ENCLOSING!r} is about the object; "
                f"expected objects = [{ITSELF!r}] with it, or another proxy"
            )
    if shells[-1].proxy == "plane":
        raise ValueError(
            f"shells: the last, {shells[-1].name!r}, holds the background too, which is on no plane; "
            "expected another proxy"
        )
    held: dict[str, str] = {}
    for shell in shells:
        for name in shell.objects:
            if name in held:
                raise ValueError(f"shells: {name!r} is in {held[name]!r} and again in {shell.name!r}")
            # What lies beyond the limits is left for another.
            if not shell.limits:
                held[name] = shell.name
