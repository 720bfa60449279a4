"""A PEM as one binary glTF file: a plain mesh for any viewer, the maps for those that know the extension."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.files import atomic_output, check_writable
from mirrorbake.pem.export.glb_file import GlbFile
from mirrorbake.pem.export.gltf_material import add_textures, fresnel_description, gltf_material
from mirrorbake.pem.export.map_sets import (
    axis_descriptions,
    fade_degrees,
    run_time_of,
    sample_set,
    static_set,
)
from mirrorbake.pem.export.materials import export_materials
from mirrorbake.pem.export.mesh_file import has_border
from mirrorbake.pem.export.radiance_code import RadianceCode, to_atlas
from mirrorbake.scene.texture_coordinates import atlas_bounds

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from mirrorbake.pem.export.map_sets import MapSet, ShellMap
    from mirrorbake.pem.export.materials import Materials
    from mirrorbake.pem.store import PemStore
    from mirrorbake.scene.build import BuiltScene

EXTENSION = "EXT_mirrorbake_pem"
EXTENSION_VERSION = 4
TEXTURE_SIZE = 2048
"""Pixels along a side that textures of the material have at most."""
_BRIGHT_PERCENTILE = 99.0


def export_glb(
    store: PemStore,
    built: BuiltScene,
    out: Path,
    *,
    samples: Sequence[int] = (),
    report: Callable[[str], None] | None = None,
) -> None:
    """Write the reflector's mesh, its materials, the static set and, if wanted, maps of samples.

    Parameters
    ----------
    store
        A complete PEM.
    built
        The scene that it was baked from.
    out
        A .glb file, written whole or not at all.
    samples
        Numbers of the samples whose maps go into the file beside the static set.
    report
        Called with a sentence for each thing that the file lacks.

    Raises
    ------
    InputError
        The file cannot be written, or would be larger than the format allows.
    OptionError
        There is no such sample.
    """
    check_writable(out)

    def sets() -> Iterator[MapSet]:
        yield static_set(store)
        yield from (sample_set(store, index) for index in samples)

    file = GlbFile()
    of_part = built.scene.object_part_materials(built.reflector)
    numbers = sorted(set(of_part))
    exported = export_materials(built.scene, numbers)
    described, notes = _add_materials(file, built, numbers, exported)
    code = _code_for(sets())
    extension: dict[str, Any] = {
        "version": EXTENSION_VERSION,
        "runTime": run_time_of(store),
        "axes": axis_descriptions(store.header.space),
        "projection": store.header.projection,
        "radianceCode": {"low": code.low, "high": code.high, "epsilon": code.epsilon},
        "sets": [_add_set(file, maps, code) for maps in sets()],
    }
    if fade_degrees(store) is not None:
        extension["fadeDegrees"] = fade_degrees(store)
    lightmap = _add_lightmap(file, store, built)
    if lightmap is not None:
        extension["lightmap"] = lightmap
    materials = [numbers.index(number) for number in of_part]
    primitives = _add_mesh(file, store, built, exported, materials)
    file.document.update(
        {
            "asset": {"version": "2.0", "generator": f"mirrorbake {_core.version()}"},
            "extensionsUsed": sorted({EXTENSION, *_extensions_in(described)}),
            "extensions": {EXTENSION: extension},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [_node(store)],
            "meshes": [{"name": "reflector", "primitives": primitives}],
            "materials": described,
        }
    )
    if any(axis.name == "motion" for axis in store.header.space.axes):
        notes.append("the reflector's motion is left out: its mesh is where it starts")
    data = file.to_bytes()
    with atomic_output(out) as temporary:
        temporary.write_bytes(data)
    for note in notes if report is not None else ():
        assert report is not None
        report(note)


def _add_materials(
    file: GlbFile, built: BuiltScene, numbers: Sequence[int], exported: Materials
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return glTF's materials, and a sentence for each thing that they lack."""
    result, notes, added = [], list(exported.notes), dict[int, int]()
    open_shell = has_border(built.positions, built.triangles)
    for number, entry in zip(numbers, exported.materials, strict=True):
        material = built.scene.material(number)
        described, lacking = gltf_material(material)
        notes += lacking
        described.setdefault("extensions", {})
        if open_shell:
            described["doubleSided"] = True
        add_textures(described, entry, exported.textures, file, TEXTURE_SIZE, added)
        described["extensions"][EXTENSION] = {
            "fresnel": fresnel_description(material.fresnel),
            "layers": material.layers,
            "albedo": list(material.albedo),
        }
        result.append(described)
    return result, list(dict.fromkeys(notes))


def _extensions_in(value: Any) -> set[str]:
    """Names of the extensions that a part of the document uses."""
    if isinstance(value, list):
        return set().union(*(_extensions_in(item) for item in value))
    if not isinstance(value, dict):
        return set()
    names = set(value.get("extensions", {}))
    return names.union(*(_extensions_in(item) for item in value.values()))


def _code_for(sets: Iterator[MapSet]) -> RadianceCode:
    bright, largest = 0.0, 0.0
    for maps in sets:
        for shell in _shells(maps):
            radiance = shell.pyramid[:, :3]
            bright = max(bright, float(np.percentile(radiance, _BRIGHT_PERCENTILE)))
            largest = max(largest, float(radiance.max()))
    return RadianceCode.for_range(bright, largest)


def _shells(maps: MapSet) -> Iterator[ShellMap]:
    for shells in maps.parts.values():
        yield from shells


def _add_set(file: GlbFile, maps: MapSet, code: RadianceCode) -> dict[str, Any]:
    written: dict[int, dict[str, Any]] = {}
    parts = []
    for part, shells in maps.parts.items():
        for shell in shells:
            if id(shell) not in written:
                written[id(shell)] = _add_shell(file, f"{maps.name} {part} {shell.name}", shell, code)
        parts.append({"name": part, "shells": [written[id(shell)] for shell in shells]})
    description: dict[str, Any] = {"name": maps.name, "parts": parts}
    if maps.point is not None:
        description["point"] = list(maps.point)
    return description


def _add_shell(file: GlbFile, name: str, shell: ShellMap, code: RadianceCode) -> dict[str, Any]:
    radiance = to_atlas(code.encode(shell.pyramid[:, :3]), shell.size, shell.projection)
    entry: dict[str, Any] = {
        "name": shell.name,
        "proxy": _proxy(shell.proxy),
        "size": shell.size,
        "radiance": file.add_png(f"{name} radiance", radiance.astype(np.uint8)),
    }
    if shell.off_hull:
        entry["offHull"] = True
    if shell.channels == 4:
        alpha = np.rint(255.0 * np.clip(shell.pyramid[:, 3:], 0.0, 1.0)).astype(np.uint8)
        atlas = to_atlas(alpha, shell.size, shell.projection).astype(np.uint8)
        entry["alpha"] = file.add_png(f"{name} alpha", atlas[..., 0])
    return entry


def _node(store: PemStore) -> dict[str, Any]:
    node: dict[str, Any] = {"name": "reflector", "mesh": 0}
    if any(store.header.origin):
        node["translation"] = list(store.header.origin)
    return node


def _proxy(description: dict[str, Any]) -> dict[str, Any]:
    names = {"half_extent": "halfExtent"}
    return {names.get(key, key): value for key, value in description.items()}


def _add_lightmap(file: GlbFile, store: PemStore, built: BuiltScene) -> dict[str, Any] | None:
    """Add the body's irradiance where it is a map on the bounds of the texture coordinates."""
    irradiance = store.read_irradiance() if store.header.lightmap else None
    if irradiance is None:
        return None
    (left, bottom), (right, top) = atlas_bounds(built.scene.object_mesh(built.reflector)).tolist()
    described: dict[str, Any] = {
        "size": store.header.lightmap,
        # v down, as in glTF
        "low": [left, 1.0 - top],
        "high": [right, 1.0 - bottom],
        "front": file.add_values(irradiance[:, :3]),
    }
    if irradiance.shape[1] > 3:
        described["back"] = file.add_values(irradiance[:, 3:])
    return described


def _add_mesh(
    file: GlbFile, store: PemStore, built: BuiltScene, exported: Materials, materials: Sequence[int]
) -> list[dict[str, Any]]:
    """One primitive for each part and its material; in each, triangles on the hull come last."""
    mesh = built.scene.object_mesh(built.reflector)
    attributes = {"POSITION": file.add_vertices(np.asarray(built.positions, np.float32), bounds=True)}
    if len(mesh.normals):
        attributes["NORMAL"] = file.add_vertices(np.asarray(mesh.normals, np.float32))
    if len(mesh.uvs):
        uvs = np.asarray(mesh.uvs, np.float32) * np.array([1, -1], np.float32)
        uvs[:, 1] += 1.0  # v down
        attributes["TEXCOORD_0"] = file.add_vertices(uvs)
    # A colour of glTF multiplies the base colour, which is the reflectance of a metal.
    tinted = [max(entry.albedo) > 0.0 or entry.colors_tint_reflectance for entry in exported.materials]
    colors = (
        file.add_vertices(np.asarray(mesh.colors, np.float32)) if len(mesh.colors) and any(tinted) else None
    )
    # Zeros are no tangents; what no primitive with a normal texture reads may be any unit vector.
    turned = np.array(mesh.tangents, np.float32)
    is_turned = turned[:, 3] != 0.0
    turned[~is_turned] = (1.0, 0.0, 0.0, 1.0)
    tangents = file.add_vertices(turned) if is_turned.any() and len(mesh.normals) else None
    irradiance = None if store.header.lightmap else store.read_irradiance()
    if irradiance is not None:
        attributes["_IRRADIANCE"] = file.add_vertices(np.ascontiguousarray(irradiance[:, :3]))
        if irradiance.shape[1] > 3:
            attributes["_IRRADIANCE_BACK"] = file.add_vertices(np.ascontiguousarray(irradiance[:, 3:]))
    local = store.read_local_triangles()
    stacked = np.ones(len(built.triangles), np.bool_) if local is None else local != 0
    primitives = []
    for part, material in enumerate(materials):
        chosen = built.parts == part
        if not chosen.any():
            continue
        triangles = np.concatenate([built.triangles[chosen & stacked], built.triangles[chosen & ~stacked]])
        own = {"COLOR_0": colors} if colors is not None and tinted[material] else {}
        bumpy = exported.materials[material].normal_texture is not None
        if bumpy and tangents is not None and is_turned[built.triangles[chosen]].all():
            own["TANGENT"] = tangents
        primitives.append(
            {
                "attributes": {**attributes, **own},
                "indices": file.add_indices(triangles.reshape(-1)),
                "material": material,
                "extensions": {EXTENSION: {"part": part, "stackIndices": 3 * int((chosen & stacked).sum())}},
            }
        )
    return primitives
