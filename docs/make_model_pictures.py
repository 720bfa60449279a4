"""Draws the pictures of the page on models: PEMs of glTF files beside Mitsuba, and how far they agree.

    python docs/make_model_pictures.py PANORAMA NAME=FILE=PEM ...

FILE is the model, PEM what `mirrorbake bake --object FILE --sky PANORAMA` made of it. Mitsuba (`pip install
mitsuba`) gets the model's triangles from the reader under test, but materials and textures by a reader of its
own, below: its principled BSDF is glTF's metallic-roughness model by other hands.
"""

from __future__ import annotations

import io
import json
import struct
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mirrorbake.envmap import EnvMap
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.render import picture_of
from mirrorbake.pem.store import PemStore
from mirrorbake.scene.build import BuiltScene, build_scene
from mirrorbake.scene.config import SceneConfig
from mirrorbake.tone import srgb_bytes

FOLDER = Path(__file__).parent / "images"
SAMPLES = 128
"""Of Mitsuba, per pixel."""
VIEW = 0.5

Array = np.ndarray[Any, Any]


class GltfTextures:
    """Materials of a glTF document, and its images as files."""

    def __init__(self, path: Path, folder: Path) -> None:
        self._path, self._folder, self._binary = path, folder, b""
        data = path.read_bytes()
        if data[:4] == b"glTF":
            (length,) = struct.unpack_from("<I", data, 12)
            self._document = json.loads(data[20 : 20 + length])
            self._binary = data[28 + length :]
        else:
            self._document = json.loads(data)

    def material(self, name: str) -> dict[str, Any]:
        """Return a material by name, the default one if there is none."""
        materials: list[dict[str, Any]] = self._document.get("materials", [])
        return next((material for material in materials if material.get("name") == name), {})

    def image(self, reference: dict[str, Any]) -> Array:
        """Return the image of a texture, (H, W, 3 or 4) of 8 bits."""
        texture = self._document["textures"][reference["index"]]
        source = texture.get("extensions", {}).get("EXT_texture_webp", texture)["source"]
        image = self._document["images"][source]
        if "uri" in image:
            return np.asarray(Image.open(self._path.parent / image["uri"]).convert("RGB"))
        view = self._document["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        packed = self._binary[start : start + view["byteLength"]]
        return np.asarray(Image.open(io.BytesIO(packed)).convert("RGB"))

    def bitmap(self, reference: dict[str, Any], channel: int | None, factor: Any, *, raw: bool) -> Any:
        """Return a Mitsuba texture of an image, or of one channel of it, times a factor."""
        texels = self.image(reference).astype(np.float64)
        if raw:
            texels = texels if channel is None else texels[..., channel : channel + 1]
            encoded = texels * np.asarray(factor)
        else:
            linear = texels / 255.0
            linear = np.where(linear <= 0.04045, linear / 12.92, ((linear + 0.055) / 1.055) ** 2.4)
            linear = linear * np.asarray(factor)
            encoded = 255.0 * np.where(
                linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055
            )
        number = len(list(self._folder.iterdir()))
        file = self._folder / f"texture-{number}.png"
        Image.fromarray(np.squeeze(np.rint(encoded).clip(0, 255).astype(np.uint8))).save(file)
        transform = reference.get("extensions", {}).get("KHR_texture_transform", {})
        su, sv = transform.get("scale", (1.0, 1.0))
        import mitsuba as mi

        to_uv = mi.ScalarTransform4f().scale([su, sv, 1.0])
        return {"type": "bitmap", "filename": str(file), "raw": raw, "to_uv": to_uv}

    def bsdf(self, name: str, *, colored: bool) -> dict[str, Any]:
        """Return Mitsuba's model of a material."""
        material = self.material(name)
        pbr = material.get("pbrMetallicRoughness", {})
        base = pbr.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])[:3]
        color: dict[str, Any] = {"type": "rgb", "value": base}
        if "baseColorTexture" in pbr:
            color = self.bitmap(pbr["baseColorTexture"], None, base, raw=False)
        elif colored:
            color = {"type": "mesh_attribute", "name": "vertex_color"}
        metallic, roughness = pbr.get("metallicFactor", 1.0), pbr.get("roughnessFactor", 1.0)
        result: dict[str, Any] = {
            "type": "principled",
            "base_color": color,
            "metallic": metallic,
            "roughness": max(roughness, 0.03),
            "specular": 0.5,
        }
        if "metallicRoughnessTexture" in pbr:
            reference = pbr["metallicRoughnessTexture"]
            result["metallic"] = self.bitmap(reference, 2, metallic, raw=True)
            result["roughness"] = self.bitmap(reference, 1, roughness, raw=True)
        if "normalTexture" in material:
            bump = self.bitmap(material["normalTexture"], None, 1.0, raw=True)
            result = {"type": "normalmap", "normalmap": bump, "bsdf": result}
        return {"type": "twosided", "bsdf": result}

    def emitter(self, name: str) -> dict[str, Any] | None:
        """Return Mitsuba's area light of what a material emits."""
        material = self.material(name)
        factor = material.get("emissiveFactor", [0.0, 0.0, 0.0])
        if not any(factor):
            return None
        radiance: Any = {"type": "rgb", "value": factor}
        if "emissiveTexture" in material:
            radiance = self.bitmap(material["emissiveTexture"], None, factor, raw=False)
        return {"type": "area", "radiance": radiance}


def write_ply(path: Path, columns: dict[str, Array], triangles: Array) -> None:
    vertices = np.stack([column.astype("<f4") for column in columns.values()], axis=1)
    faces = np.zeros(len(triangles), [("count", "u1"), ("corners", "<u4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in columns]
    header += [f"element face {len(faces)}", "property list uchar uint vertex_indices", "end_header"]
    path.write_bytes("\n".join(header).encode() + b"\n" + vertices.tobytes() + faces.tobytes())


def peer_scene(built: BuiltScene, model: Path, sky: Path, folder: Path) -> dict[str, Any]:
    """Return Mitsuba's scene of a model under a panorama."""
    import mitsuba as mi

    textures = GltfTextures(model, folder)
    mesh = built.scene.object_mesh(built.reflector)
    materials = np.asarray(built.scene.object_part_materials(built.reflector))
    kind = (
        materials[np.asarray(mesh.parts)] if len(mesh.parts) else np.full(len(mesh.triangles), materials[0])
    )
    axes = "xyz"
    scene: dict[str, Any] = {"type": "scene", "integrator": {"type": "path", "max_depth": 8}}
    for number in dict.fromkeys(materials.tolist()):
        mine = np.asarray(mesh.triangles)[kind == number]
        used, renumbered = np.unique(mine, return_inverse=True)
        columns = {axes[i]: np.asarray(mesh.positions)[used, i] for i in range(3)}
        if len(mesh.normals):
            columns |= {f"n{axes[i]}": np.asarray(mesh.normals)[used, i] for i in range(3)}
        if len(mesh.uvs):
            # Mitsuba counts v downwards in images, as glTF does.
            columns |= {"u": np.asarray(mesh.uvs)[used, 0], "v": 1.0 - np.asarray(mesh.uvs)[used, 1]}
        colors = np.asarray(mesh.colors)[used] if len(mesh.colors) else np.ones((len(used), 3))
        colored = bool(np.ptp(colors, axis=0).max() > 0.01)
        if colored:
            columns |= {f"vertex_color_{'rgb'[i]}": colors[:, i] for i in range(3)}
        name = built.scene.material(number).name
        write_ply(folder / f"{number}.ply", columns, renumbered.reshape(-1, 3))
        shape: dict[str, Any] = {"type": "ply", "filename": str(folder / f"{number}.ply")}
        shape["bsdf"] = textures.bsdf(name, colored=colored)
        emitter = textures.emitter(name)
        scene[f"part-{number}"] = shape | ({} if emitter is None else {"emitter": emitter})
    panorama = EnvMap.load(sky)
    lit = EnvMap.from_array(np.maximum(np.asarray(panorama), 0.0), "latlong").to_convention("mitsuba")
    lit.save(folder / "sky.exr")
    scene["sky"] = {"type": "envmap", "filename": str(folder / "sky.exr")}
    camera = built.cameras.camera((VIEW,))
    scene["sensor"] = {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f().look_at(origin=camera.eye, target=camera.target, up=camera.up),
        "fov": camera.vertical_fov_degrees,
        "fov_axis": "y",
        "near_clip": 1e-3,
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
    }
    return scene


def picture(name: str, model: Path, pem: str, sky: Path) -> str:
    """Write the picture of a model; a row of the page's table."""
    import mitsuba as mi  # An optional peer.

    store = PemStore.open(pem)
    ours = np.asarray(picture_of(open_pem(pem), (VIEW,)))
    built = build_scene(SceneConfig.model_validate(store.header.source.config))
    with tempfile.TemporaryDirectory() as folder:
        scene = mi.load_dict(peer_scene(built, model, sky, Path(folder)))
        halves = [np.asarray(mi.render(scene, spp=SAMPLES // 2, seed=seed), np.float32) for seed in (1, 2)]
    theirs = 0.5 * (halves[0] + halves[1])
    seen = np.asarray(store.read_images(len(built.space) // 2).coverage) > 0.99
    shown = srgb_bytes(np.concatenate([ours, theirs], axis=1))
    Image.fromarray(shown).save(FOLDER / f"model-{name}.webp", quality=85, method=6)
    # The mean has half of the noise's power that is in each half, which differ by twice that.
    noise = psnr(halves[0], halves[1], seen) + 6.0
    brightness = float(ours[seen].mean() / theirs[seen].mean())
    return f"| {name} | {psnr(ours, theirs, seen):.1f} dB | {brightness:.2f} | {noise:.1f} dB |"


def main() -> None:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    for argument in sys.argv[2:]:
        name, model, pem = argument.split("=")
        print(picture(name, Path(model), pem, Path(sys.argv[1])), flush=True)


if __name__ == "__main__":
    main()
