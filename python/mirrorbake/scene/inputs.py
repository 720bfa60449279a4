"""The files that a scene uses, and their hashes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from mirrorbake import _core
from mirrorbake.files import sha256_of
from mirrorbake.scene.config import (
    PATH_KEYS,
    SceneConfig,
)

if TYPE_CHECKING:
    from mirrorbake.literals import FileContent

Inputs: TypeAlias = dict[str, dict[str, Any]]
"""Files of a scene: key → {path, sha256, files}; `files`, if it refers to any, are {name: sha256}."""

_CONTENT: dict[str, FileContent] = {
    "reflector.mesh": "mesh",
    "surroundings.scene": "scene",
}
"""Inputs that refer to further files."""


def hash_inputs(config: SceneConfig) -> Inputs:
    """Files that a scene uses, with those that they refer to: buffers, textures, material libraries.

    Raises
    ------
    InputError
        One cannot be read; the message names it.
    mirrorbake.FileError
        A mesh or a scene is corrupt, so that what it refers to is not known.
    """
    inputs: Inputs = {}
    for section, key in PATH_KEYS:
        path = getattr(getattr(config, section), key, None)
        if path is None:
            continue
        name = f"{section}.{key}"
        inputs[name] = {"path": path, "sha256": sha256_of(Path(path))}
        if name in _CONTENT:
            # A mesh that is of the file's own materials refers to their images, too.
            whole = name == "reflector.mesh" and config.material is None
            content = "scene" if whole else _CONTENT[name]
            folder = Path(path).resolve().parent
            files = [Path(file) for file in _core.referenced_files(path, content)]
            inputs[name]["files"] = {
                file.relative_to(folder).as_posix(): sha256_of(file) for file in sorted(files)
            }
    return inputs
