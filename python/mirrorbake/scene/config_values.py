"""The kinds of values that scene files have, and the checks that they share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

MAX_IMAGE_SIDE = 16384
MAX_MAP_SIZE = 4096


def as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _as_rgb(value: Any) -> Any:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return (value, value, value)
    return as_tuple(value)


def _power_of_two(value: int) -> int:
    if value & (value - 1):
        raise ValueError("Input should be a power of two")
    return value


def _none_for_auto(value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
    try:
        return validate(None if value == "auto" else value)
    except ValidationError as failure:
        if not isinstance(value, str):
            raise
        expected = failure.errors()[0]["msg"].removeprefix("Value error, ")
        raise ValueError(f"{expected}, or 'auto'") from None


def _auto_for_none(value: Any) -> Any:
    return "auto" if value is None else value


AUTO = (WrapValidator(_none_for_auto), PlainSerializer(_auto_for_none))
"""Makes None of a file's "auto", and "auto" of None."""

Vec3: TypeAlias = Annotated[tuple[float, float, float], BeforeValidator(as_tuple)]
"""Three numbers."""

Reflectance: TypeAlias = Annotated[
    tuple[
        Annotated[float, Field(ge=0, le=1)],
        Annotated[float, Field(ge=0, le=1)],
        Annotated[float, Field(ge=0, le=1)],
    ],
    BeforeValidator(_as_rgb),
]
"""R, G, B in [0,1]; one number stands for all three."""

Index: TypeAlias = Annotated[
    tuple[
        Annotated[float, Field(gt=0, le=1e6)],
        Annotated[float, Field(gt=0, le=1e6)],
        Annotated[float, Field(gt=0, le=1e6)],
    ],
    BeforeValidator(_as_rgb),
]
"""Real part of a refractive index per channel; one number stands for all three."""

Extinction: TypeAlias = Annotated[
    tuple[
        Annotated[float, Field(ge=0, le=1e6)],
        Annotated[float, Field(ge=0, le=1e6)],
        Annotated[float, Field(ge=0, le=1e6)],
    ],
    BeforeValidator(_as_rgb),
]
"""Imaginary part of a refractive index per channel; one number stands for all three."""

ImageSide: TypeAlias = Annotated[int, Field(ge=1, le=MAX_IMAGE_SIDE)]
MapSize: TypeAlias = Annotated[int, Field(ge=1, le=MAX_MAP_SIZE), AfterValidator(_power_of_two)]
LightmapSize: TypeAlias = Annotated[int, Field(ge=0, le=MAX_MAP_SIZE), AfterValidator(_power_of_two)]


def one_of(*names: str) -> AfterValidator:
    """Return the check that a text is one of several names, which come from a table."""

    def check(value: str) -> str:
        if value not in names:
            raise ValueError(f"Input should be {', '.join(map(repr, names[:-1]))} or {names[-1]!r}")
        return value

    return AfterValidator(check)


def with_default(data: Any, keys: tuple[str, ...], value: str) -> Any:
    """Return a section with a value for the first of several keys, where none of them is given."""
    if isinstance(data, Mapping) and all(data.get(key) is None for key in keys):
        return {**data, keys[0]: value}
    return data


class Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)
