"""What the attributes of a PEM may say: whatever else they hold is one clear error."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from mirrorbake import _core
from mirrorbake.errors import StoreError
from mirrorbake.projection import MAP_PROJECTIONS
from mirrorbake.proxy import SHAPES, proxy_from_attributes
from mirrorbake.scene.config_shells import ShellRule
from mirrorbake.scene.config_values import MAX_IMAGE_SIDE, MAX_MAP_SIZE, one_of

FORMAT_VERSION = 7
MAX_SAMPLES = 100_000_000
MAX_PARTS = 65535

Number = Annotated[float, Field(allow_inf_nan=False)]
Triple = Annotated[list[Number], Field(min_length=3, max_length=3)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class ProxyAttributes(_Model):
    """A shape, as `mirrorbake.proxy.proxy_to_attributes` returns it."""

    model_config = ConfigDict(extra="allow")

    shape: str
    origin: Triple
    axes: Annotated[list[Triple], Field(min_length=3, max_length=3)] | None = None
    __pydantic_extra__: dict[str, Number | Triple] = Field(init=False)
    """Its centre and extents."""

    @model_validator(mode="after")
    def _is_a_shape(self) -> ProxyAttributes:
        if self.shape not in SHAPES:
            raise ValueError(f"no such shape: {self.shape}; expected {', '.join(SHAPES)}")
        description = self.model_dump(exclude_none=True)
        for key in description.keys() - {"shape", "origin", *SHAPES[self.shape]}:
            raise ValueError(f"a {self.shape} has no {key!r}")
        try:
            proxy_from_attributes(description)
        except KeyError as missing:
            raise ValueError(f"a {self.shape} needs {missing}") from None
        except TypeError:
            raise ValueError(f"an extent of the {self.shape} is of another kind") from None
        return self


class AxisAttributes(_Model):
    """An axis of the parameter space."""

    name: Annotated[str, Field(min_length=1, max_length=100)]
    values: Annotated[list[Number], Field(min_length=1, max_length=MAX_SAMPLES)]
    low: Number
    high: Number
    period: Annotated[Number, Field(gt=0)] | None

    @model_validator(mode="after")
    def _rises(self) -> AxisAttributes:
        values = self.values
        rising = all(a < b for a, b in itertools.pairwise(values))
        if not rising or values[0] < self.low or values[-1] > self.high:
            raise ValueError(f"the values of the axis {self.name} do not rise from low to high")
        return self


class ShellAttributes(_Model):
    """A shell of a part."""

    name: Annotated[str, Field(min_length=1, max_length=1000)]
    proxy: ProxyAttributes
    map: Annotated[str, Field(min_length=1, max_length=2000)]
    polygons: Literal["all", "off hull"]
    moves: bool
    size: Annotated[int, Field(ge=1, le=MAX_MAP_SIZE)]


class PartAttributes(_Model):
    """A part of the reflector."""

    name: Annotated[str, Field(max_length=1000)]
    shells: Annotated[list[ShellAttributes], Field(min_length=1, max_length=64)]


class MapAttributes(_Model):
    """A map of every sample."""

    name: Annotated[str, Field(min_length=1, max_length=2000)]
    channels: Literal[3, 4]
    size: Annotated[int, Field(ge=1, le=MAX_MAP_SIZE)]


class FadeAttributes(_Model):
    """How a PEM fades to the static set."""

    degrees: Annotated[Number, Field(gt=0, le=1000)]


class StaticAttributes(_Model):
    """Shapes for the captured map, and when the static set is drawn."""

    infinite: ProxyAttributes
    proxy: ProxyAttributes | None
    fade: FadeAttributes | None


class RunTimeAttributes(_Model):
    """For which run time the maps were inferred."""

    name: Literal["reference", "Web", "Web1", "Reference"]
    lookups: Annotated[int, Field(ge=1, le=65536)]
    footprint_scale: Annotated[Number, Field(gt=0, le=64)]


class Attributes(_Model):
    """All of the group's attribute."""

    format: Literal["pem"]
    format_version: Literal[7]
    library: Annotated[str, Field(max_length=100)]
    fingerprint: Sha256
    conventions: dict[str, Any]
    projection: Annotated[str, one_of(*MAP_PROJECTIONS)]
    map_size: Annotated[int, Field(ge=1, le=MAX_MAP_SIZE)]
    precision: Literal["float16", "float32"]
    image_size: Annotated[
        list[Annotated[int, Field(ge=1, le=MAX_IMAGE_SIDE)]], Field(min_length=2, max_length=2)
    ]
    origin: Triple
    space: Annotated[list[AxisAttributes], Field(max_length=8)]
    shells: Annotated[list[ShellRule], Field(min_length=1, max_length=_core.MOST_SHELLS)]
    parts: Annotated[list[PartAttributes], Field(min_length=1, max_length=MAX_PARTS)]
    maps: Annotated[list[MapAttributes], Field(min_length=1, max_length=64 * MAX_PARTS)]
    static: StaticAttributes
    run_time: RunTimeAttributes
    record: list[str]
    config: dict[str, Any]
    plan: dict[str, Any]
    inputs: dict[str, dict[str, Any]]
    provenance: dict[str, str]
    checksum: Sha256

    @model_validator(mode="after")
    def _fits_together(self) -> Attributes:
        for size in (self.map_size, *(entry.size for entry in self.maps)):
            if size & (size - 1):
                raise ValueError(f"a map of {size} texels: should be a power of two")
        if self.map_size != max(entry.size for entry in self.maps):
            raise ValueError(f"map_size = {self.map_size}: should be that of the largest map")
        count = 1
        for axis in self.space:
            count *= len(axis.values)
        if count > MAX_SAMPLES:
            raise ValueError(f"the space has {count} samples, at most {MAX_SAMPLES} are possible")
        known = {entry.name: (entry.channels, entry.size) for entry in self.maps}
        rules = [rule.name for rule in self.shells]
        if len(set(rules)) < len(rules):
            raise ValueError("shells: two of one name")
        for part in self.parts:
            names = [shell.name for shell in part.shells]
            if names != [name for name in rules if name in names] or names[-1] != rules[-1]:
                raise ValueError(
                    f"part {part.name}: its shells are not some of {', '.join(rules)} with the last"
                )
            for shell in part.shells:
                channels = 3 if shell is part.shells[-1] else 4
                if known.get(shell.map) != (channels, shell.size):
                    raise ValueError(f"shell {shell.name} of {part.name}: no such map: {shell.map}")
        return self


def checksum_of(attributes: Mapping[str, Any]) -> str:
    """SHA-256 of attributes, their own checksum left out."""
    content = {key: value for key, value in attributes.items() if key != "checksum"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def check_attributes(attributes: Any, where: str) -> dict[str, Any]:
    """Return attributes after checking all that they say.

    Raises
    ------
    StoreError
        They are of another format, or something in them is not as it was written; the message names the
        first thing.
    """
    if not isinstance(attributes, Mapping):
        raise StoreError(f"{where}: damaged, or not a PEM: its attribute is missing")
    version = attributes.get("format_version")
    if version != FORMAT_VERSION:
        known = isinstance(version, int) and not isinstance(version, bool) and 0 < version < FORMAT_VERSION
        advice = "; bake it anew with `mirrorbake bake SCENE.toml --out ANOTHER_DIR`" if known else ""
        raise StoreError(f"{where}: format version {version!r}, this library reads {FORMAT_VERSION}{advice}")
    try:
        Attributes.model_validate(attributes)
    except ValidationError as failure:
        first = failure.errors()[0]
        place = ".".join(str(step) for step in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        raise StoreError(f"{where}: damaged: {place or 'attributes'}: {message}") from None
    if checksum_of(attributes) != attributes["checksum"]:
        raise StoreError(f"{where}: damaged: the attributes do not match their checksum")
    return dict(attributes)
