"""Reading scene files, with errors that name the key. Relative paths are relative to the file."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from mirrorbake.errors import InputError, OptionError
from mirrorbake.files import read_text
from mirrorbake.scene.config import PATH_KEYS, SECTIONS, SceneConfig

if TYPE_CHECKING:
    from os import PathLike

    from pydantic_core import ErrorDetails

MAX_SCENE_BYTES = 1 << 20
_EXPECTATIONS = {
    "extra_forbidden": "is not a key of this section",
    "missing": "is required",
    "model_type": "should be a section",
}


def _describe(error: ErrorDetails) -> str:
    # Steps such as 'function-before[...]' are pydantic's own, not keys of the file.
    key = ".".join(str(step) for step in error["loc"] if "[" not in str(step))
    kind = error["type"]
    if kind == "extra_forbidden":
        return f"{key}: {_EXPECTATIONS[kind]}{_suggestion([str(step) for step in error['loc']])}"
    if kind in _EXPECTATIONS:
        return f"{key}: {_EXPECTATIONS[kind]}"
    message = error["msg"].removeprefix("Value error, ").replace("Input should", "should")
    if isinstance(error["input"], Mapping):
        return f"{key}: {message}"
    return f"{key} = {error['input']!r}: {message}"


def _suggestion(keys: Sequence[str]) -> str:
    """Return words for the key that was probably meant; none if none is like it."""
    known: list[str] = list(SceneConfig.model_fields)
    for key in (key for key in keys[:-1] if not key.isdigit()):
        section = SECTIONS.get(key)
        known = [] if section is None else list(section.model_fields)
    close = difflib.get_close_matches(keys[-1], known, n=1)
    return f"; did you mean `{close[0]}`?" if close else ""


def _describe_all(errors: Sequence[ErrorDetails]) -> str:
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return _describe(errors[0]) + more


def parse_config(data: Mapping[str, Any], source: str) -> SceneConfig:
    """Validate a scene given as nested mappings.

    Parameters
    ----------
    data
        What a TOML parser gives for a scene file.
    source
        Name that error messages start with.

    Raises
    ------
    InputError
        Names the first wrong key, its value and what was expected.

    Examples
    --------
    >>> parse_config({"maps": {"size": 128}}, "example").maps.size
    128
    >>> parse_config({"maps": {"size": 100}}, "example")
    Traceback (most recent call last):
    mirrorbake.errors.InputError: example: maps.size = 100: should be a power of two
    """
    try:
        return SceneConfig.model_validate(data)
    except ValidationError as failure:
        raise InputError(f"{source}: {_describe_all(failure.errors())}") from None


def parse_override(text: str) -> tuple[tuple[str, ...], Any]:
    """Split `section.key=value` into the key path and the value, read as TOML or else as a plain string.

    Examples
    --------
    >>> parse_override("maps.size=128")
    (('maps', 'size'), 128)
    >>> parse_override("reflector.mesh=bunny.obj")
    (('reflector', 'mesh'), 'bunny.obj')
    """
    key, separator, value = text.partition("=")
    path = tuple(step.strip() for step in key.split("."))
    if not separator or len(path) < 2 or not all(path):
        raise OptionError(f"--set {text!r}: expected section.key=value")
    try:
        return path, tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        return path, value.strip()


def _read_toml(path: Path) -> dict[str, Any]:
    text = read_text(path, at_most=MAX_SCENE_BYTES)
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as failure:
        raise InputError(f"{path}: not valid TOML: {failure}") from None


DRAFT: Mapping[str, Mapping[str, Any]] = {
    "views": {"count": 9, "degrees": 16.0, "size": [256, 256]},
    "maps": {"size": 128},
    "trace": {"samples": 32, "most_samples": 64},
}
"""Values for a first bake of a minute or two."""


def load_config(
    path: str | PathLike[str] | None,
    overrides: Sequence[tuple[tuple[str, ...], Any]] = (),
    *,
    draft: bool = False,
) -> SceneConfig:
    """Read and validate a scene file.

    Parameters
    ----------
    path
        The TOML file. Relative paths in it are resolved against its folder. None: an empty one.
    draft
        Whether keys that are not given have the values of `DRAFT`, for a first look.
    overrides
        Key paths with values that replace the file's, as of `parse_override`; relative paths in them are
        resolved against the current folder. An override of `reflector.mesh` drops `reflector.object`, and so
        on.

    Raises
    ------
    InputError
        The file is missing or not TOML, or a key is wrong. It is an OptionError if the key, or one that it
        does not go with, is an override.
    """
    data: dict[str, Any] = {}
    if path is not None:
        data = _read_toml(Path(path))
        _resolve_paths(data, Path(path).resolve().parent)
    if draft:
        _add_draft(data)
    replacements: dict[str, Any] = {}
    for keys, value in overrides:
        _insert(replacements, keys, value)
    _resolve_paths(replacements, Path.cwd())
    _merge(data, replacements)
    try:
        return SceneConfig.model_validate(data)
    except ValidationError as failure:
        errors = failure.errors()
        if any(_concerns(errors[0], keys) for keys, _ in overrides):
            raise OptionError(_describe_all(errors)) from None
        raise InputError(f"{path}: {_describe_all(errors)}") from None


def _add_draft(data: dict[str, Any]) -> None:
    for section, values in DRAFT.items():
        given = data.setdefault(section, {})
        if not isinstance(given, dict):
            continue
        # A dome's and a single camera's counts and degrees mean other things than an arc's.
        is_arc = given.get("kind", "arc") == "arc"
        for key, value in values.items():
            if is_arc or key == "size":
                given.setdefault(key, value)


def _concerns(error: ErrorDetails, keys: tuple[str, ...]) -> bool:
    place = error["loc"]
    shared = min(len(place), len(keys))
    return shared > 0 and place[:shared] == keys[:shared]


# What a new value of a key makes meaningless.
_ALTERNATIVES: Mapping[str, tuple[str, ...]] = {
    "reflector.mesh": ("object", "scene_object"),
    "reflector.object": ("mesh", "scene_object"),
    "reflector.scene_object": ("object", "mesh"),
    "material.fresnel": ("r0", "ior", "eta", "k", "metal"),
    "material.metal": ("eta", "k"),
    "material.eta": ("metal",),
    "material.k": ("metal",),
    "surroundings.panorama": ("room",),
    "surroundings.scene": ("room", "ground"),
    "surroundings.room": ("panorama", "scene", "ground"),
}


def _insert(data: dict[str, Any], keys: tuple[str, ...], value: Any) -> None:
    for key in keys[:-1]:
        data = data.setdefault(key, {})
        if not isinstance(data, dict):
            raise OptionError(f"--set {'.'.join(keys)}: {key} is not a section")
    data[keys[-1]] = value


def _merge(data: dict[str, Any], replacements: Mapping[str, Any], path: tuple[str, ...] = ()) -> None:
    for key, value in replacements.items():
        if isinstance(value, Mapping) and isinstance(data.get(key), dict):
            _merge(data[key], value, (*path, key))
            continue
        data[key] = value
        for other in _ALTERNATIVES.get(".".join((*path, key)), ()):
            if other not in replacements:
                data.pop(other, None)


def _resolve_paths(data: Mapping[str, Any], folder: Path) -> None:
    for section, key in PATH_KEYS:
        table = data.get(section)
        if isinstance(table, dict) and isinstance(table.get(key), str):
            table[key] = str(folder / table[key])
