"""Types of the arguments that are one of several names, as the compiled part has them."""

from __future__ import annotations

from typing import Literal, TypeAlias

__all__ = [
    "ConventionWay",
    "FaceLayout",
    "FileContent",
    "FresnelModel",
    "HarmonicWindow",
    "Illuminant",
    "LobeScale",
    "MipFilter",
    "NegativeLight",
    "PixelFormat",
    "ResampleFilter",
    "RoughnessScale",
    "SampleFilter",
    "TextureWrap",
]

ConventionWay: TypeAlias = Literal["from_foreign", "to_foreign"]
FaceLayout: TypeAlias = Literal["automatic", "strip", "column", "grid", "cross", "vertical_cross", "files"]
FileContent: TypeAlias = Literal["mesh", "scene"]
FresnelModel: TypeAlias = Literal["constant", "schlick", "dielectric", "conductor"]
HarmonicWindow: TypeAlias = Literal["none", "hanning", "sloan"]
Illuminant: TypeAlias = Literal["D65", "E"]
LobeScale: TypeAlias = Literal["mean", "sum"]
MipFilter: TypeAlias = Literal["box", "solid_angle", "seamless"]
NegativeLight: TypeAlias = Literal["clamp", "keep"]
PixelFormat: TypeAlias = Literal["automatic", "half", "float32", "uint8", "uint16"]
ResampleFilter: TypeAlias = Literal["automatic", "area", "bilinear", "nearest"]
RoughnessScale: TypeAlias = Literal["squared", "linear"]
SampleFilter: TypeAlias = Literal["nearest", "bilinear", "trilinear", "ewa"]
TextureWrap: TypeAlias = Literal["repeat", "clamp", "mirror"]
