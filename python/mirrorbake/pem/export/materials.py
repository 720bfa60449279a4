"""The reflector's materials and textures as exporters hand them on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from skimage.transform import resize_local_mean

if TYPE_CHECKING:
    from collections.abc import Callable

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray


@dataclass(frozen=True)
class TextureUse:
    """A texture of a material; its coordinates are transformed as KHR_texture_transform has it."""

    texture: int
    """Number in `Materials.textures`."""
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    rotation: float = 0.0
    """Radians."""

    @property
    def matrix(self) -> tuple[float, float, float, float, float, float]:
        """Rows of the 2×3 matrix from the mesh's coordinates to the image's; v counts downwards in both.

        >>> TextureUse(0, offset=(0.5, 0.25), scale=(2.0, 3.0)).matrix
        (2.0, 0.0, 0.5, -0.0, 3.0, 0.25)
        """
        c, s = math.cos(self.rotation), math.sin(self.rotation)
        (x, y), (u, v) = self.scale, self.offset
        return (c * x, s * y, u, -s * x, c * y, v)


@dataclass(frozen=True)
class Material:
    """One material; colours are scene-linear."""

    name: str
    fresnel: _core.Fresnel
    specular: bool
    coated: bool
    """Whether the diffuse layer lies below the mirror: it gets 1 − F of the light."""
    albedo: tuple[float, float, float]
    albedo_texture: TextureUse | None
    """Multiplies `albedo`."""
    reflectance_texture: TextureUse | None
    """Multiplies `fresnel.r0`."""
    normal_texture: TextureUse | None
    """Tangent-space normals as glTF 2.0 has them."""
    normal_scale: float
    colors_tint_reflectance: bool
    """Whether the vertices' colours multiply `fresnel.r0`, as they do `albedo`."""


@dataclass(frozen=True)
class TextureImage:
    """A texture that materials use."""

    pixels: Callable[[int], FloatArray]
    """`pixels(largest)`: the image (H, W, 3) with at most `largest` pixels along a side, row 0 on top."""
    wrap: tuple[str, str]
    """`repeat`, `clamp` or `mirror` of u and v."""
    linear: bool
    """Whether it holds numbers, not colours: normals."""


@dataclass(frozen=True)
class Materials:
    """All of an object's."""

    materials: tuple[Material, ...]
    textures: tuple[TextureImage, ...]
    notes: tuple[str, ...]
    """A sentence for each thing that is not described here."""


def export_materials(scene: _core.Scene, numbers: list[int]) -> Materials:
    """Describe materials of a scene, in the order of their numbers."""
    textures: dict[tuple[int, bool], TextureImage] = {}

    def use(reference: _core.TextureReference, *, linear: bool = False) -> TextureUse | None:
        if reference.texture < 0:
            return None
        key = (reference.texture, linear)
        if key not in textures:
            wrap_u, wrap_v = scene.texture_wrap(reference.texture)
            textures[key] = TextureImage(
                lambda largest: texture_pixels(scene, reference.texture, largest),
                (wrap_u, wrap_v),
                linear,
            )
        return TextureUse(
            list(textures).index(key),
            (reference.offset[0], reference.offset[1]),
            (reference.scale[0], reference.scale[1]),
            reference.rotation,
        )

    materials = []
    notes = []
    for number in numbers:
        material = scene.material(number)
        if max(material.emission) > 0.0:
            notes.append(f"the light that the material {material.name} emits is left out")
        if material.opacity_texture.texture >= 0 or material.opacity < 1.0:
            notes.append(f"the gaps in the material {material.name} are left out")
        materials.append(
            Material(
                name=material.name,
                fresnel=material.fresnel,
                specular=material.specular,
                coated=material.layers == "coated",
                albedo=(material.albedo[0], material.albedo[1], material.albedo[2]),
                albedo_texture=use(material.albedo_texture) if max(material.albedo) > 0.0 else None,
                reflectance_texture=use(material.specular_texture) if material.specular else None,
                normal_texture=use(material.normal_texture, linear=True),
                normal_scale=material.normal_scale,
                colors_tint_reflectance=material.colors_tint_reflectance,
            )
        )
    return Materials(tuple(materials), tuple(textures.values()), tuple(notes))


def texture_pixels(scene: _core.Scene, texture: int, largest: int) -> FloatArray:
    """Return a texture's image, each pixel the mean of the texels in it, shape (H, W, 3), scene-linear."""
    pixels: FloatArray = scene.texture_pixels(texture)
    height, width = pixels.shape[:2]
    if pixels.shape[2] == 1:
        pixels = np.repeat(pixels, 3, axis=2)
    scale = largest / max(height, width)
    if scale >= 1.0:
        return pixels
    shape = (max(round(height * scale), 1), max(round(width * scale), 1))
    smaller: FloatArray = resize_local_mean(pixels, shape, channel_axis=2).astype(np.float32)
    return smaller
