"""A reflector's material as near as glTF's comes to it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake.fresnel import conductor
from mirrorbake.pem.export.images import linear_codes, srgb_codes
from mirrorbake.pem.export.materials import TextureUse

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mirrorbake import _core
    from mirrorbake.pem.export.glb_file import GlbFile
    from mirrorbake.pem.export.materials import Material, TextureImage

# Schlick and constant reflectances up to that of an index of 2.5 (diamond, titania) are those of dielectrics.
_LARGEST_DIELECTRIC_R0 = ((2.5 - 1.0) / (2.5 + 1.0)) ** 2


def gltf_material(material: _core.Material) -> tuple[dict[str, Any], list[str]]:
    """Describe a material by glTF's metal or dielectric.

    Returns
    -------
    tuple
        The glTF material, and a sentence for each thing that glTF has no words for.
    """
    notes = []
    fresnel = material.fresnel
    albedo = list(material.albedo)
    roughness = _perceptual_roughness(material)
    result: dict[str, Any] = {"name": material.name}
    r0 = _normal_reflectance(fresnel)
    dielectric = fresnel.model == "dielectric" or (
        fresnel.model != "conductor" and max(r0) <= _LARGEST_DIELECTRIC_R0
    )
    if dielectric:
        # glTF: F0 = ((ior - 1)/(ior + 1))² · specularColorFactor, F90 = 1.
        root = math.sqrt(max(r0))
        result["pbrMetallicRoughness"] = _metallic_roughness(albedo, 0.0, roughness)
        result["extensions"] = {"KHR_materials_ior": {"ior": (1.0 + root) / (1.0 - root)}}
        if max(r0) > min(r0):
            result["extensions"]["KHR_materials_specular"] = {
                "specularColorFactor": [value / max(r0) for value in r0]
            }
    else:
        result["pbrMetallicRoughness"] = _metallic_roughness(r0, 1.0, roughness)
        if max(albedo) > 0.0:
            notes.append("a metal of glTF has no diffuse colour: the albedo is left out of its material")
    return result, notes


def add_textures(
    described: dict[str, Any],
    material: Material,
    images: Sequence[TextureImage],
    file: GlbFile,
    largest: int,
    added: dict[int, int],
) -> None:
    """Add the textures of a material to what `gltf_material` returned, at most `largest` pixels wide.

    `added` has the numbers in the file of images that are there already, and gets those of the others.
    """

    def info(use: TextureUse) -> dict[str, Any]:
        if use.texture not in added:
            image = images[use.texture]
            pixels = image.pixels(largest)
            codes = linear_codes(pixels) if image.linear else srgb_codes(pixels)
            added[use.texture] = file.add_texture(f"texture {use.texture}", codes, image.wrap)
        return {"index": added[use.texture], **_transform(use)}

    surface = described["pbrMetallicRoughness"]
    base = material.reflectance_texture if surface["metallicFactor"] > 0.0 else material.albedo_texture
    if base is not None:
        surface["baseColorTexture"] = info(base)
    if material.reflectance_texture is not None and base is not material.reflectance_texture:
        specular = described["extensions"].setdefault("KHR_materials_specular", {})
        specular["specularColorTexture"] = info(material.reflectance_texture)
    if material.normal_texture is not None:
        described["normalTexture"] = {**info(material.normal_texture), "scale": material.normal_scale}


def _transform(use: TextureUse) -> dict[str, Any]:
    if replace(use, texture=0) == TextureUse(0):
        return {}
    transform = {"offset": list(use.offset), "rotation": use.rotation, "scale": list(use.scale)}
    return {"extensions": {"KHR_texture_transform": transform}}


def fresnel_description(fresnel: _core.Fresnel) -> dict[str, Any]:
    """What a shader needs to compute the reflectance; the names are those of the scene file."""
    name = fresnel.model
    if fresnel.model == "dielectric":
        return {"model": name, "ior": list(fresnel.eta)}
    if fresnel.model == "conductor":
        return {"model": name, "eta": list(fresnel.eta), "k": list(fresnel.k)}
    return {"model": name, "r0": list(fresnel.r0)}


def _metallic_roughness(colour: Sequence[float], metallic: float, roughness: float) -> dict[str, Any]:
    return {
        "baseColorFactor": [*(min(max(float(value), 0.0), 1.0) for value in colour), 1.0],
        "metallicFactor": metallic,
        "roughnessFactor": roughness,
    }


def _normal_reflectance(fresnel: _core.Fresnel) -> list[float]:
    if fresnel.model == "dielectric":
        return [((n - 1.0) / (n + 1.0)) ** 2 for n in fresnel.eta]
    if fresnel.model == "conductor":
        pairs = zip(fresnel.eta, fresnel.k, strict=True)
        return [float(conductor(np.float64(1.0), eta, k)) for eta, k in pairs]
    return list(fresnel.r0)


def _perceptual_roughness(material: _core.Material) -> float:
    """Roughness of glTF: it is the root of GGX's α; of a Phong lobe, α of the same width: √(2/(N + 2))."""
    if material.lobe == "mirror":
        return 0.0
    if material.lobe == "phong":
        return math.sqrt(math.sqrt(2.0 / (material.exponent + 2.0)))
    return math.sqrt(material.roughness)
