"""What the attributes of a PEM say."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from mirrorbake.pem.pyramid import coarser_sizes
from mirrorbake.scene.parameters import ParameterSpace
from mirrorbake.scene.plan import Plan

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mirrorbake.scene.inputs import Inputs

FORMAT_VERSION = 3


@dataclass(frozen=True)
class Source:
    """What a PEM is made from."""

    library: str
    """Version of mirrorbake that writes it."""
    config: dict[str, Any]
    """The scene file with its defaults filled in and absolute paths."""
    inputs: Inputs
    """Files that the scene uses."""

    @property
    def fingerprint(self) -> str:
        """Changes with everything that decides what a bake computes, but not with where its inputs lie."""
        text = json.dumps([FORMAT_VERSION, self.library, self._content()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def _content(self) -> dict[str, Any]:
        content: dict[str, Any] = json.loads(json.dumps(self.config))
        for key, source in self.inputs.items():
            section, name = key.split(".")
            content[section][name] = {"sha256": source["sha256"], "files": source.get("files", {})}
        return content

    def difference_from(self, other: Source) -> str:
        """Words for the first thing in which this source differs from another."""
        if self.library != other.library:
            return f"mirrorbake {other.library} instead of {self.library}"
        mine, others = self._content(), other._content()
        for section, table in mine.items():
            present = others[section] or {}
            for key, value in (table or {}).items():
                theirs = present.get(key)
                if theirs != value:
                    name = f"{section}.{key}"
                    if name in self.inputs and name in other.inputs:
                        assert theirs is not None
                        return f"{name}: {_changed_file(value, theirs)}"
                    return f"{name} = {theirs!r} instead of {value!r}"
            if table is None and others[section] is not None:
                return f"a section [{section}] instead of none"
        return "nothing"


def _changed_file(mine: Mapping[str, Any], theirs: Mapping[str, Any]) -> str:
    if mine["sha256"] != theirs["sha256"]:
        return "a file of other content"
    a, b = mine["files"], theirs["files"]
    name = min(name for name in {**a, **b} if a.get(name) != b.get(name))
    if name not in a:
        return f"its file {name} is missing"
    return f"its file {name} " + ("has another content" if name in b else "was not there")


@dataclass(frozen=True)
class Header:
    """What the attributes of a PEM say."""

    source: Source
    plan: Plan
    """What was decided before the bake; a resumed one keeps to it."""
    space: ParameterSpace
    """At whose nodes the maps are."""
    parts: list[dict[str, Any]]
    """Per part of the reflector, in order: name, and layers as {layer name: proxy}."""
    static: dict[str, Any]
    """Proxies of the static maps: `infinite`, and `proxy`: the distant layer's, None if that is infinite."""
    map_size: int
    precision: Literal["float16", "float32"]
    image_size: tuple[int, int]
    """Pixels: width, height."""

    @property
    def fingerprint(self) -> str:
        """Changes with everything that decides what a bake computes: its source and its plan."""
        text = json.dumps([self.source.fingerprint, self.plan.to_json()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def to_attributes(self) -> dict[str, Any]:
        """Return the JSON-like value of the group's attribute."""
        return {
            "format": "pem",
            "format_version": FORMAT_VERSION,
            "library": self.source.library,
            "fingerprint": self.fingerprint,
            "conventions": {
                "world": "right-handed, +Y up, metres",
                "radiance": "scene-linear, Rec.709 primaries",
                "faces": "+X -X +Y -Y +Z -Z, OpenGL orientation, row 0 on top",
                "residuals": "level l = mean of 2x2 blocks of level l-1, from `finest` down, plus residual",
                "level_sizes": [self.map_size, *coarser_sizes(self.map_size)],
            },
            "map_size": self.map_size,
            "precision": self.precision,
            "image_size": list(self.image_size),
            "space": self.space.to_attributes(),
            "parts": self.parts,
            "static": self.static,
            "config": self.source.config,
            "plan": self.plan.to_json(),
            "inputs": self.source.inputs,
        }

    @staticmethod
    def from_attributes(attributes: Mapping[str, Any]) -> Header:
        """Inverse of `to_attributes`. Raises KeyError or TypeError for what is not one."""
        width, height = attributes["image_size"]
        return Header(
            source=Source(attributes["library"], attributes["config"], attributes["inputs"]),
            plan=Plan.from_json(attributes["plan"]),
            space=ParameterSpace.from_attributes(attributes["space"]),
            parts=attributes["parts"],
            static=attributes["static"],
            map_size=attributes["map_size"],
            precision=attributes["precision"],
            image_size=(width, height),
        )

    def map_names(self) -> list[tuple[str, str]]:
        """(part, layer) of every map of a view."""
        return [(part["name"], layer) for part in self.parts for layer in part["layers"]]
