"""A PEM as files for a web page: a manifest in JSON, images, and the mesh (spec section 10).

`docs/reference/web-format.md` describes the files.
"""

from __future__ import annotations

import gzip
import json
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.pem.export.blocks import blocks_of, filled, pixels_of
from mirrorbake.pem.export.images import ImageFormat, linear_codes, probe_image, srgb_codes
from mirrorbake.pem.export.mesh_file import write_irradiance, write_mesh
from mirrorbake.pem.export.radiance_code import RadianceCode, to_atlas
from mirrorbake.projection import MAP_PROJECTIONS
from mirrorbake.tone import srgb_bytes, tone_map

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.export.materials import Material, TextureUse
    from mirrorbake.pem.export.source import ExportSource

FORMAT_NAME = "mirrorbake-web"
FORMAT_VERSION = 6
MANIFEST_NAME = "manifest.json"

PROBED_SAMPLES = 16
"""Samples that are read to find the range of the radiance; brighter texels of others are clamped."""


STATIC_SET_QUALITY = 57
"""By which the static set's AVIF images are worse: where it shows, it is far from ray tracing by itself."""

ALPHA_QUALITY = 6
"""By which images of α are worse than the radiance of samples."""

OTHER_QUALITY = 40
"""By which the captured surroundings and the stills are worse: they are looked at and not looked up."""


@dataclass(frozen=True)
class WebOptions:
    """What `web_files` writes."""

    format: ImageFormat = field(default_factory=lambda: ImageFormat(exact=False))
    fallback: bool = True
    """Also write images without loss, which the page takes if a browser shows the others wrongly."""
    stills: bool = True
    """The ray-traced pictures of the samples, to compare with."""
    trim: bool = True
    """Of a sample only what views near it read, the rest from the static set, if there is one. Images without
    loss alone hold everything."""
    texture_size: int = 1024
    """Pixels along a side that textures of the materials have at most."""

    @property
    def has_fallback(self) -> bool:
        """Whether there are images without loss beside lossy ones."""
        return self.fallback and not self.format.exact


class WebPem:
    """The files of a PEM on the web, made one by one when they are asked for.

    >>> def first_picture(pem: WebPem) -> int:  # bytes until there is one
    ...     return sum(len(pem.read(name)) for name in pem.names[:5])
    """

    def __init__(self, source: ExportSource, options: WebOptions | None = None) -> None:
        self._source = source
        self._options = options or WebOptions()
        self._code = _code_of(source)
        self._makers: dict[str, Callable[[], bytes]] = {}
        self._first = len(source.space) // 2
        exact = self._options.format.exact
        trims = self._options.trim and not exact and source.static_maps is not None
        self._reads = source.reads if trims else None
        self._blocks: tuple[int, list[NDArray[np.bool_]]] | None = None
        self._collect()

    @property
    def names(self) -> list[str]:
        """Names of all files, with slashes, in the order in which a page wants them; the manifest first."""
        return list(self._makers)

    def read(self, name: str) -> bytes:
        """Bytes of a file.

        Raises
        ------
        KeyError
            There is no such file.
        StoreError
            The PEM is damaged.
        """
        return self._makers[name]()

    def _collect(self) -> None:
        source, options, code = self._source, self._options, self._code
        form = options.format
        mesh, layout = write_mesh(source.mesh)
        probe = form.encode(probe_image())
        manifest = json.dumps(self._manifest(layout, probe), separators=(",", ":")) + "\n"
        self._makers[MANIFEST_NAME] = manifest.encode
        self._makers["poster.avif"] = self._poster
        self._makers["probe" + form.suffix] = lambda: probe
        self._makers["mesh.bin.gz"] = lambda: mesh
        self._add(
            "static/capture",
            lambda: to_atlas(code.encode(source.static), source.static_size, source.projection),
            _worse(form, OTHER_QUALITY),
        )
        for t in range(len(source.materials.textures)):
            self._add(_texture_name(t), partial(self._texture, t))
        # Samples may need the static set. Then the one that is shown first, and outwards from it.
        if source.static_maps is not None:
            self._add_maps("static", source.static_maps.__getitem__, None)
        for i in sorted(range(len(source.space)), key=lambda i: abs(i - self._first)):
            if source.irradiance is not None:
                self._makers[_irradiance_name(i)] = partial(self._irradiance, i)
            if self._reads is not None:
                self._makers[_blocks_name(i)] = partial(self._packed_blocks, i)
            self._add_maps(f"samples/{i:05d}", partial(source.pyramid, i), i)
        if options.stills:
            for i in range(len(source.space)):
                self._add(_still_name(i), partial(self._still, i), _worse(form, OTHER_QUALITY))

    def _add_maps(self, folder: str, pyramid: Callable[[int], FloatArray], sample: int | None) -> None:
        """Add the images of all maps of a sample, or of the static set."""
        form = self._options.format
        if sample is None:
            form = _worse(form, STATIC_SET_QUALITY)
        grey = _worse(form, ALPHA_QUALITY)
        for m, entry in enumerate(self._source.maps):
            self._add(f"{folder}/{m}", partial(self._radiance, pyramid, m, sample), form)
            if not entry.opaque:
                self._add(f"{folder}/{m}.alpha", partial(self._alpha, pyramid, m, sample), grey)

    def _add(
        self, name: str, pixels: Callable[[], NDArray[np.uint8]], form: ImageFormat | None = None
    ) -> None:
        lossy, exact = form or self._options.format, ImageFormat(exact=True)
        self._makers[name + lossy.suffix] = lambda: lossy.encode(pixels())
        if self._options.has_fallback:
            self._makers[f"exact/{name}{exact.suffix}"] = lambda: exact.encode(pixels())

    def _poster(self) -> bytes:
        return ImageFormat(exact=False, quality=50).encode(
            srgb_bytes(tone_map(self._source.still(self._first)))
        )

    def _radiance(
        self, pyramid: Callable[[int], FloatArray], number: int, sample: int | None
    ) -> NDArray[np.uint8]:
        codes = self._code.encode(pyramid(number)[:, :3])
        return self._atlas(codes, number, sample)

    def _alpha(
        self, pyramid: Callable[[int], FloatArray], number: int, sample: int | None
    ) -> NDArray[np.uint8]:
        alpha = np.rint(np.clip(pyramid(number)[:, 3:4], 0.0, 1.0) * 255.0).astype(np.uint8)
        return self._atlas(alpha, number, sample)[..., 0]

    def _atlas(self, codes: NDArray[np.uint8], number: int, sample: int | None) -> NDArray[np.uint8]:
        """Return the image of a map, filled where a sample's is not read."""
        atlas = to_atlas(codes, self._source.maps[number].size, self._source.projection)
        blocks = self._blocks_of(sample)
        if blocks is None:
            return atlas
        return filled(atlas, pixels_of(blocks[number], *atlas.shape[:2]))

    def _blocks_of(self, sample: int | None) -> list[NDArray[np.bool_]] | None:
        """Return the blocks of a sample's maps that are its own; None: all are."""
        if self._reads is None or sample is None:
            return None
        if self._blocks is None or self._blocks[0] != sample:
            entries = zip(self._reads(sample), self._source.maps, strict=True)
            found = [blocks_of(texels, entry.size, self._source.projection) for texels, entry in entries]
            self._blocks = (sample, found)
        return self._blocks[1]

    def _packed_blocks(self, sample: int) -> bytes:
        blocks = self._blocks_of(sample)
        assert blocks is not None
        return gzip.compress(b"".join(np.packbits(one).tobytes() for one in blocks), 9, mtime=0)

    def _texture(self, number: int) -> NDArray[np.uint8]:
        texture = self._source.materials.textures[number]
        pixels = texture.pixels(self._options.texture_size)
        return linear_codes(pixels) if texture.linear else srgb_codes(pixels)

    def _irradiance(self, sample: int) -> bytes:
        assert self._source.irradiance is not None
        return write_irradiance(self._source.irradiance(sample), self._source.mesh)

    def _still(self, sample: int) -> NDArray[np.uint8]:
        return self._code.encode(self._source.still(sample))

    def _manifest(self, mesh: dict[str, Any], probe: bytes) -> dict[str, Any]:
        source, form = self._source, self._options.format
        return {
            "format": FORMAT_NAME,
            "version": FORMAT_VERSION,
            "library": _core.version(),
            "title": source.title,
            "notes": list(source.notes),
            "runTime": source.run_time,
            "axes": source.space.to_attributes(),
            "origin": list(source.origin),
            "camera": source.camera,
            "motion": source.motion,
            "materials": [_material(material) for material in source.materials.materials],
            "textures": [
                {"image": _texture_name(t), "wrap": list(texture.wrap), "linear": texture.linear}
                for t, texture in enumerate(source.materials.textures)
            ],
            "radiance": {"low": self._code.low, "high": self._code.high, "epsilon": self._code.epsilon},
            "images": {
                "suffix": form.suffix,
                "type": form.media_type,
                "exact": form.exact,
                "fallback": self._options.has_fallback,
            },
            "probe": {
                "file": "probe" + form.suffix,
                # A lossy image is not the one that was encoded, but everybody decodes the same.
                "colours": form.decode(probe)[4, 4::8].tolist(),
            },
            "poster": {"file": "poster.avif", "type": "image/avif"},
            "mesh": {"file": "mesh.bin.gz", **mesh},
            "projection": source.projection,
            "maps": [
                {"name": entry.name, "size": entry.size, "opaque": entry.opaque} for entry in source.maps
            ],
            "parts": [
                {
                    "name": part.name,
                    "shells": [
                        {
                            "name": shell.name,
                            "map": shell.map,
                            "proxy": shell.proxy,
                            "moves": shell.moves,
                            "onHull": shell.on_hull,
                        }
                        for shell in part.shells
                    ],
                }
                for part in source.parts
            ],
            "static": {
                "image": "static/capture",
                "size": source.static_size,
                "proxy": source.static_proxy,
                "maps": None if source.static_maps is None else self._map_files("static"),
                "fadeDegrees": source.fade_degrees,
            },
            "samples": [self._sample(i) for i in range(len(source.space))],
            "first": self._first,
        }

    def _sample(self, i: int) -> dict[str, Any]:
        return {
            "parameter": list(self._source.space.sample(i)),
            "maps": self._map_files(f"samples/{i:05d}"),
            "blocks": None if self._reads is None else _blocks_name(i),
            "still": _still_name(i) if self._options.stills else None,
            "irradiance": None if self._source.irradiance is None else _irradiance_name(i),
        }

    def _map_files(self, folder: str) -> list[dict[str, str | None]]:
        return [
            {"radiance": f"{folder}/{m}", "alpha": None if entry.opaque else f"{folder}/{m}.alpha"}
            for m, entry in enumerate(self._source.maps)
        ]


def _worse(form: ImageFormat, by: int) -> ImageFormat:
    return replace(form, quality=max(form.quality - by, 1))


def _material(material: Material) -> dict[str, Any]:
    """Plain values of what the page needs to know of a material."""

    def use(texture: TextureUse | None) -> dict[str, Any] | None:
        return None if texture is None else {"texture": texture.texture, "matrix": list(texture.matrix)}

    fresnel = material.fresnel
    return {
        "name": material.name,
        "specular": material.specular,
        "fresnel": fresnel.model,
        "r0": list(fresnel.r0),
        "eta": list(fresnel.eta),
        "k": list(fresnel.k),
        "coated": material.coated,
        "albedo": list(material.albedo),
        "albedoTexture": use(material.albedo_texture),
        "reflectanceTexture": use(material.reflectance_texture),
        "normalTexture": use(material.normal_texture),
        "normalScale": material.normal_scale,
        "colorsTintReflectance": material.colors_tint_reflectance,
    }


def _texture_name(number: int) -> str:
    return f"textures/{number}"


def _irradiance_name(sample: int) -> str:
    return f"samples/{sample:05d}/irradiance.bin.gz"


def _blocks_name(sample: int) -> str:
    return f"samples/{sample:05d}/blocks.bin.gz"


def _still_name(sample: int) -> str:
    return f"samples/{sample:05d}/still"


def _code_of(source: ExportSource) -> RadianceCode:
    """Return a code that holds the radiance of the maps, of at most `PROBED_SAMPLES` samples."""
    count = len(source.space)
    probed = np.unique(np.linspace(0, count - 1, min(count, PROBED_SAMPLES)).round().astype(int))
    bright, largest = [], float(source.static.max())
    for i in probed:
        for m, entry in enumerate(source.maps):
            finest = source.pyramid(int(i), m)[: MAP_PROJECTIONS[source.projection].faces * entry.size**2, :3]
            bright.append(float(np.percentile(finest[::7], 99.0)))
            largest = max(largest, float(finest.max()))
    for pyramid in source.static_maps or ():
        largest = max(largest, float(pyramid[:, :3].max()))
    return RadianceCode.for_range(float(np.median(bright)), largest)
