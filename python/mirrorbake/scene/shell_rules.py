"""From names in [[shells]] to the tracer's rules on objects."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from mirrorbake import _core
from mirrorbake.errors import InputError
from mirrorbake.scene.config_shells import ITSELF

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mirrorbake.scene.config_shells import Shells, ShellSection


def trace_rules(shells: Shells, names: Sequence[str], reflector: int) -> list[_core.ShellRule]:
    """Return the tracer's rules.

    Parameters
    ----------
    shells
        Of a scene file, front to back.
    names
        Of the scene's objects.
    reflector
        Number of the reflector among them.

    Raises
    ------
    InputError
        The scene has no such object, or a shell gets nothing since those before it hold its objects.

    Examples
    --------
    >>> from mirrorbake.scene.config_shells import ShellSection
    >>> ground, rest = ShellSection(name="ground", objects=("floor*",)), ShellSection(name="rest")
    >>> trace_rules((ground, rest), ["floor/oak", "cup", "floor/tiles"], 1)[0].objects
    [0, 2]
    """
    rules, held = [], dict[int, str]()
    for shell in shells:
        objects: list[int] = []
        for name in shell.objects:
            objects += [i for i in _objects(name, shell, names, reflector) if i not in objects]
        for number in objects:
            if number in held:
                what = ITSELF if number == _core.ShellRule.ITSELF else names[number]
                raise InputError(
                    f"shells: {what!r} is in {held[number]!r} and again in {shell.name!r}, "
                    "which gets nothing of it"
                )
            # What lies beyond the limits is left for another.
            if not shell.limits:
                held[number] = shell.name
        rules.append(_core.ShellRule(shell.name, objects, **shell.limits))
    return rules


def _objects(name: str, shell: ShellSection, names: Sequence[str], reflector: int) -> list[int]:
    if name == ITSELF:
        return [_core.ShellRule.ITSELF]
    if name == names[reflector]:
        raise InputError(f"shells.{shell.name}: object {name!r} is the reflector; expected {ITSELF!r}")
    found = [i for i, known in enumerate(names) if i != reflector and _is(known, name)]
    if not found:
        others = [known for i, known in enumerate(names) if i != reflector]
        known = ", ".join(others[:20]) + (", …" if len(others) > 20 else "")
        raise InputError(
            f"shells.{shell.name}: the scene has no object {name!r}; "
            f"expected {ITSELF!r}{' or one of: ' + known if others else ''}"
        )
    return found


def _is(known: str, name: str) -> bool:
    # Brackets occur in names of objects; only the star is a pattern.
    return known == name or ("*" in name and fnmatchcase(known, name.replace("[", "[[]").replace("?", "[?]")))
