"""What the attributes of a PEM say."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from mirrorbake import _core
from mirrorbake.pem.pyramid import coarser_sizes, topology_of
from mirrorbake.pem.schema import FORMAT_VERSION, checksum_of
from mirrorbake.pem.shells import MapEntry, Part, Shell, maps_of
from mirrorbake.projection import MAP_PROJECTIONS
from mirrorbake.scene.config_shells import ShellRule
from mirrorbake.scene.parameters import ParameterSpace
from mirrorbake.scene.plan import Plan

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mirrorbake.scene.inputs import Inputs

RECORD = ("trace_s", "build_s", "solve_s", "clamped_maps", "clamped_reference")
MAP_RECORD = ("iterations", "gradient", "converged")


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
            if not isinstance(table or {}, dict) or not isinstance(others[section] or {}, dict):
                if table != others[section]:
                    return f"{section} = {others[section]!r} instead of {table!r}"
                continue
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
    rules: tuple[ShellRule, ...]
    """What reflected rays meet, split front to back."""
    parts: tuple[Part, ...]
    """Of the reflector, in order."""
    static: dict[str, Any]
    """Proxies of the captured map: `infinite`, and `proxy`: the distant layer's, None if that is infinite.
    `fade`: `degrees` beyond the samples at which half of the static set shows; None: there is no such set."""
    projection: str
    """Of all maps."""
    map_size: int
    """Texels along a side of a face of the finest level of the largest map."""
    precision: Literal["float16", "float32"]
    image_size: tuple[int, int]
    """Pixels: width, height."""
    origin: tuple[float, float, float]
    """Where the zero of all positions lies in the scene file's world, metres."""
    run_time: dict[str, Any]
    """For what the maps were inferred: name, lookups per pixel, footprint_scale in pixels."""

    @property
    def fingerprint(self) -> str:
        """Changes with everything that decides what a bake computes: its source and its plan."""
        text = json.dumps([self.source.fingerprint, self.plan.to_dict(), self.run_time], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def to_attributes(self) -> dict[str, Any]:
        """Return the JSON-like value of the group's attribute."""
        attributes = {
            "format": "pem",
            "format_version": FORMAT_VERSION,
            "library": self.source.library,
            "fingerprint": self.fingerprint,
            "conventions": {
                "world": "right-handed, +Y up, metres; positions are relative to `origin`",
                "radiance": "scene-linear, Rec.709 primaries",
                "faces": MAP_PROJECTIONS[self.projection].order,
                "texels": "finest level (face, row, column), then residuals of the coarser levels, then 0",
                "residuals": "level l = mean of 2x2 blocks of level l-1, from the finest down, plus residual",
                "level_sizes": [self.map_size, *coarser_sizes(self.map_size)],
                "shells": "front to back, L = L0 + (1 - a0)(L1 + (1 - a1)(...)); RGBA premultiplied by a",
                "reference": "R G B of the object, its coverage, R G B of the background times the rest",
            },
            "projection": self.projection,
            "map_size": self.map_size,
            "precision": self.precision,
            "image_size": list(self.image_size),
            "origin": list(self.origin),
            "space": self.space.to_attributes(),
            "shells": [rule.model_dump() for rule in self.rules],
            "parts": [asdict(part) | {"shells": [asdict(s) for s in part.shells]} for part in self.parts],
            "maps": [asdict(entry) for entry in self.maps],
            "static": self.static,
            "run_time": self.run_time,
            "record": list(self.record_columns),
            "config": self.source.config,
            "plan": self.plan.to_dict(),
            "inputs": self.source.inputs,
            "provenance": provenance(),
        }
        return {**attributes, "checksum": checksum_of(attributes)}

    @staticmethod
    def from_attributes(attributes: Mapping[str, Any]) -> Header:
        """Inverse of `to_attributes`, for attributes that `check_attributes` has checked.

        Raises KeyError or TypeError where the plan is none.
        """
        width, height = attributes["image_size"]
        x, y, z = attributes["origin"]
        parts = (
            Part(part["name"], tuple(Shell(**shell) for shell in part["shells"]))
            for part in attributes["parts"]
        )
        return Header(
            source=Source(attributes["library"], attributes["config"], attributes["inputs"]),
            plan=Plan.from_dict(attributes["plan"]),
            space=ParameterSpace.from_attributes(attributes["space"]),
            rules=tuple(ShellRule.model_validate(rule) for rule in attributes["shells"]),
            parts=tuple(parts),
            static=attributes["static"],
            projection=attributes["projection"],
            map_size=attributes["map_size"],
            precision=attributes["precision"],
            image_size=(width, height),
            origin=(x, y, z),
            run_time=attributes["run_time"],
        )

    @property
    def faces(self) -> int:
        """Of a map."""
        return MAP_PROJECTIONS[self.projection].faces

    @property
    def topology(self) -> _core.TexelTopology:
        """How the texels of the largest map lie to each other."""
        return topology_of(self.projection, self.map_size)

    @property
    def topologies(self) -> list[_core.TexelTopology]:
        """How the texels of each map lie to each other."""
        return [topology_of(self.projection, entry.size) for entry in self.maps]

    @property
    def lightmap(self) -> int:
        """Texels along a side of the map of the diffuse layer's irradiance; 0: it is at the vertices."""
        return self.plan.lightmap

    @property
    def sizes_in_words(self) -> str:
        """Texels of the maps' faces: `256²`, or `64² to 256²`."""
        sizes = sorted({entry.size for entry in self.maps})
        return f"{sizes[0]}²" if len(sizes) == 1 else f"{sizes[0]}² to {sizes[-1]}²"

    @property
    def is_static_set(self) -> bool:
        """Whether the maps have no parameters: they were inferred from views all around."""
        return bool(self.source.config["views"]["kind"] == "none")

    @property
    def stacks(self) -> list[list[int]]:
        """For each part, the numbers of the rules that its shells end with.

        A shell holds what its own rule does and those before it that no other shell of the part holds.
        """
        numbers = {rule.name: number for number, rule in enumerate(self.rules)}
        return [[numbers[shell.name] for shell in part.shells] for part in self.parts]

    @property
    def maps(self) -> tuple[MapEntry, ...]:
        """The maps of every sample, in the order in which they are stored."""
        return maps_of(self.parts)

    @property
    def record_columns(self) -> tuple[str, ...]:
        """What is recorded of every sample: seconds, clamped values, and a report for each map."""
        return (*RECORD, *(f"{key}: {entry.name}" for entry in self.maps for key in MAP_RECORD))

    def map_names(self) -> list[tuple[str, str]]:
        """(part, shell) of every map that a sample is drawn from; a shared one counts for each part."""
        return [(part.name, shell.name) for part in self.parts for shell in part.shells]

    def map_of(self, part: str, shell: str) -> int:
        """Number of the map of a part's shell, in the order of `maps`; KeyError if there is none."""
        for one in self.parts:
            found = one.shell(shell) if one.name == part else None
            if found is not None:
                return [entry.name for entry in self.maps].index(found.map)
        raise KeyError(f"{part}/{shell}")


def provenance() -> dict[str, str]:
    """Return the versions that a PEM was made with."""
    return {
        "mirrorbake": _core.version(),
        "numpy": np.__version__,
        "zarr": metadata.version("zarr"),
        "python": platform.python_version(),
        "machine": platform.machine(),
        "instructions": _core.active_isa(),
    }
