"""Small PEMs for the tests of the page, with the pictures that the C++ renderer draws of them.

    python tests/support/viewer_cases.py OUT

writes a folder for each case, synthetic maps on a kind of proxy: the files of a web export, and
`reference.json` beside `reference-K.f32`, float32 RGBA pictures from the top left corner: light, and coverage
in alpha.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.pem.body_light import BodyLight
from mirrorbake.pem.export.blocks import blocks_of, pixels_of
from mirrorbake.pem.export.images import ImageFormat, linear_codes, srgb_codes
from mirrorbake.pem.export.map_sets import run_time_attributes
from mirrorbake.pem.export.materials import Materials, export_materials
from mirrorbake.pem.export.mesh_file import ReflectorMesh
from mirrorbake.pem.export.radiance_code import RadianceCode, atlas_shape, from_atlas
from mirrorbake.pem.export.source import ExportSource, MapEntry, Part, Shell
from mirrorbake.pem.export.web import WebOptions, WebPem
from mirrorbake.pem.pyramid import topology_of
from mirrorbake.pem.run_time import fade_weight
from mirrorbake.pem.shells import moved_proxy
from mirrorbake.projection import MAP_PROJECTIONS
from mirrorbake.proxy import proxy_from_attributes, proxy_to_attributes
from mirrorbake.scene.parameters import Axis, ParameterSpace
from mirrorbake.scene.pose import Pose, rotation_matrix
from mirrorbake.viewer.export import write_folder

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

WIDTH, HEIGHT, FOV = 320, 240, 30.0
DISTANCE, ELEVATION = 0.6, 20.0
PARAMETERS = (0.0, 0.5, 1.0)
ARC_DEGREES = 20.0
TURNED = [[0.8, 0.0, -0.6], [0.0, 1.0, 0.0], [0.6, 0.0, 0.8]]


@dataclass(frozen=True)
class Case:
    """One PEM."""

    name: str
    distant: _core.Proxy
    local: _core.Proxy
    fresnel: _core.Fresnel
    coated: bool = False
    textured: bool = False
    """Textures of albedo, reflectance and normals, and coloured vertices."""
    moves: bool = False
    """The object moves and turns, with its local shell; the diffuse layer changes on the way."""
    between: _core.Proxy | None = None
    """Of a third shell of the ring, behind the local one. The ball then reads the ring's distant map."""
    fade_degrees: float | None = None
    """There is a static set, to which the PEM fades."""
    projection: str = "cube"
    run_time: _core.RunTimeModel = field(default_factory=lambda: _core.run_time_model("Web"))
    segments: int = 40
    """Around the ring; 320 make triangles smaller than a pixel."""
    map_size: int = 32
    open: bool = False
    """The ball is a bowl without thickness, whose inner side gets light of its own."""
    trimmed: bool = False
    """Of a sample's texels every second half face alone are its own; the static set has the others."""
    lightmap: int = 0
    """Texels along a side of the map on texture coordinates that irradiance is; 0: it is at the vertices."""


MAPS = (4, 3, 3, 4)
"""Channels of the maps: the ring's local and distant ones, the ball's, and that of a shell between."""


def cases() -> list[Case]:
    """Every proxy as the distant shell's in both projections, every model of reflectance."""
    cubes = _cube_cases()
    on_paraboloids = [
        replace(case, name=f"{case.name}-paraboloid", projection="paraboloid") for case in cubes[:6]
    ]
    return [*cubes, *on_paraboloids]


def _cube_cases() -> list[Case]:
    origin = (0.02, 0.1, -0.03)
    local = _core.Proxy.ellipsoid(
        (0.0, 0.1, 0.0), (0.2, 0.12, 0.2), (0.0, 0.1, 0.0), np.eye(3, dtype=np.float32)
    )
    turned_local = _core.Proxy.ellipsoid(
        (0.0, 0.1, 0.0), (0.25, 0.12, 0.19), (0.0, 0.1, 0.0), np.array(TURNED, np.float32)
    )
    straight, turned = np.eye(3, dtype=np.float32), np.array(TURNED, np.float32)
    schlick = _core.Fresnel(model="schlick", r0=(0.9, 0.7, 0.5))
    return [
        Case("infinite", _core.Proxy.infinite(origin), local, schlick),
        Case("box", _core.Proxy.box((0, 1, 0), (2.0, 1.1, 1.5), origin, straight), local, schlick),
        Case(
            "rotated-box",
            _core.Proxy.box((0, 1, 0), (2.0, 1.1, 1.5), origin, turned),
            turned_local,
            _core.Fresnel(model="dielectric", eta=(1.5, 1.6, 1.7)),
            coated=True,
        ),
        Case(
            "ellipsoid",
            _core.Proxy.ellipsoid((0, 0.5, 0), (3.0, 1.5, 2.0), origin, turned),
            local,
            _core.Fresnel(model="conductor", eta=(0.2, 0.9, 1.3), k=(3.9, 2.5, 2.2)),
        ),
        Case(
            "sphere",
            _core.Proxy.ellipsoid((0, 0.5, 0), (2.0, 2.0, 2.0), origin, straight),
            local,
            schlick,
            run_time=_core.RunTimeModel(
                name="Trilinear",
                places=_core.run_time_model("Web").places,
                footprint_scale=0.5,
                filter="trilinear",
            ),
        ),
        Case(
            "hemisphere",
            _core.Proxy.hemisphere((0, -0.05, 0), 2.0, origin, turned),
            local,
            _core.Fresnel(model="constant", r0=(0.8, 0.8, 0.8)),
        ),
        Case("textured", _core.Proxy.infinite(origin), local, schlick, textured=True),
        Case(
            "moving",
            _core.Proxy.box((0, 1, 0), (2.0, 1.1, 1.5), origin, straight),
            turned_local,
            schlick,
            moves=True,
        ),
        Case(
            "shells",
            _core.Proxy.box((0, 1, 0), (2.0, 1.1, 1.5), origin, straight),
            local,
            schlick,
            between=_core.Proxy.ellipsoid((0, 0.1, 0), (0.5, 0.3, 0.4), origin, turned),
        ),
        Case(
            "small-triangles",
            _core.Proxy.box((0, 1, 0), (2.0, 1.1, 1.5), origin, straight),
            local,
            schlick,
            segments=320,
            map_size=128,
        ),
        Case("open", _core.Proxy.infinite(origin), local, schlick, open=True),
        Case(
            "open-moving",
            _core.Proxy.box((0, 1, 0), (2.0, 1.1, 1.5), origin, straight),
            turned_local,
            schlick,
            moves=True,
            open=True,
        ),
        Case("trimmed", _core.Proxy.infinite(origin), local, schlick, trimmed=True, fade_degrees=10.0),
        Case("lightmap", _core.Proxy.infinite(origin), local, schlick, lightmap=16),
        Case(
            "lightmap-open-moving",
            _core.Proxy.box((0, 1, 0), (2.0, 1.1, 1.5), origin, straight),
            turned_local,
            schlick,
            moves=True,
            open=True,
            lightmap=32,
        ),
        Case("fading", _core.Proxy.infinite(origin), local, schlick, fade_degrees=10.0),
    ]


PIVOT = (0.0, 0.1, 0.0)
MOTION = {"to": [0.06, 0.01, -0.05], "turn": 50.0, "pivot": list(PIVOT)}


def _pose(case: Case, t: float) -> Pose:
    if not case.moves:
        return Pose(np.zeros(3), 0.0)
    # The page turns about a pivot, a pose about zero.
    pivot, turned = np.array(PIVOT), t * 50.0
    offset = t * np.array(MOTION["to"]) + pivot - rotation_matrix((0.0, turned, 0.0)) @ pivot
    return Pose(offset, turned)


def _waves(shift: float) -> FloatArray:
    """A smooth picture of 64² pixels whose channels differ, in [0, 1], of 8 bits as from a file."""
    y, x = np.mgrid[0:64, 0:64] * (2.0 * math.pi / 64.0)
    channels = [0.5 + 0.3 * np.sin(x + shift + c) * np.cos(y - c) + 0.1 * np.sin(2 * y + c) for c in range(3)]
    coded = srgb_codes(np.stack(channels, axis=-1).astype(np.float32)) / 255.0
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)


def _bumps() -> FloatArray:
    """Tangent-space normals that lean by 15° at most, of 8 bits as from a file."""
    y, x = np.mgrid[0:64, 0:64] * (2.0 * math.pi / 64.0)
    lean = np.stack([0.2 * np.sin(x) * np.cos(y), 0.2 * np.sin(2 * y), np.ones_like(x)], axis=-1)
    lean /= np.linalg.norm(lean, axis=-1, keepdims=True)
    return (linear_codes((0.5 + 0.5 * lean).astype(np.float32)) / 255.0).astype(np.float32)


def _tangents(normals: FloatArray, chosen: NDArray[np.bool_]) -> FloatArray:
    """Of chosen vertices some that their coordinates know nothing of, mirrored; zeros of the others."""
    along = np.cross(normals.astype(np.float64), (0.6, 0.0, 0.8))
    length = np.linalg.norm(along, axis=1, keepdims=True)
    tangents = np.concatenate([along / np.maximum(length, 1e-6), -np.ones_like(length)], axis=1)
    tangents[~chosen | (length[:, 0] < 1e-3)] = 0.0
    return tangents.astype(np.float32)


def _turned(tangents: FloatArray, pose: Pose) -> FloatArray:
    turned = tangents[:, :3].astype(np.float64) @ pose.rotation.T
    return np.concatenate([turned.astype(np.float32), tangents[:, 3:]], axis=1)


def _maps(seed: int, channels: int, size: int, projection: str = "cube") -> FloatArray:
    """A pyramid of smooth colours with some noise on every level of its own: wrong levels are seen."""
    random = np.random.default_rng(seed)
    levels = []
    phase = random.uniform(0.0, 2.0 * math.pi, (channels, 3))
    for level in range(size.bit_length()):
        n = size >> level
        centres = (np.arange(n) + 0.5) / n
        faces = np.arange(MAP_PROJECTIONS[projection].faces)
        f, t, s = np.meshgrid(faces, centres, centres, indexing="ij")
        for_all = [
            0.5
            + 0.4 * np.sin(2.0 * math.pi * (s + 0.3 * f) + a) * np.cos(2.0 * math.pi * t + b + level)
            + 0.1 * np.sin(3.0 * f + c)
            for a, b, c in phase
        ]
        texels = np.stack(for_all, axis=-1).reshape(-1, channels)
        texels = texels + random.uniform(-0.15, 0.15, texels.shape)
        levels.append(texels)
    pyramid: FloatArray = np.clip(np.concatenate(levels), 0.0, 1.2).astype(np.float32)
    if channels == 4:
        pyramid[:, 3] = np.minimum(pyramid[:, 3], 1.0)
        pyramid[:, :3] *= pyramid[:, 3:]
    else:
        pyramid *= 3.0
    return pyramid


@dataclass(frozen=True)
class Scene:
    """A torus on a sphere's cap: two parts, the first of which has two shells, with a hull split."""

    tracer: _core.Tracer
    mesh: ReflectorMesh
    materials: Materials


def case_scene(case: Case, t: float = 0.0) -> Scene:
    torus, ball = (
        _core.make_torus((0.0, 0.1, 0.0), 0.12, 0.04, case.segments),
        _core.make_sphere((0.0, 0.13, 0.0), 0.06, 32),
    )
    first = np.asarray(torus.positions)
    ball_triangles = np.asarray(ball.triangles)
    if case.open:
        ball_triangles = ball_triangles[np.asarray(ball.positions)[ball_triangles, 1].max(axis=1) < 0.14]
    positions = np.concatenate([first, np.asarray(ball.positions)])
    normals = np.concatenate([np.asarray(torus.normals), np.asarray(ball.normals)])
    triangles = np.concatenate([np.asarray(torus.triangles), ball_triangles + np.uint32(len(first))])
    parts = np.concatenate(
        [np.zeros(len(torus.triangles), np.uint16), np.ones(len(ball_triangles), np.uint16)]
    )
    scene = _core.Scene()
    material = _core.Material(
        name="shiny",
        specular=True,
        fresnel=case.fresnel,
        albedo=(0.4, 0.4, 0.4),
        layers="coated" if case.coated else "additive",
    )
    uvs = colors = tangents = None
    if case.textured:
        tangents = _tangents(normals, np.arange(len(positions)) >= len(first))
        uvs = (6.0 * positions[:, [0, 2]]).astype(np.float32)
        colors = (0.75 + 0.25 * normals).astype(np.float32)
        use = _core.TextureReference
        material.albedo_texture = use(scene.add_texture(_waves(0.3)), rotation=0.4, scale=(1.5, 0.7))
        mirrored = scene.add_texture(_waves(1.7), "mirror", "mirror")
        material.specular_texture = use(mirrored, offset=(0.3, 0.1))
        material.normal_texture = use(scene.add_texture(_bumps()))
        material.colors_tint_reflectance = True
    if case.lightmap:
        # More than a tile, and the most of it where the open ball has vertices that no triangle uses.
        x, y, z = positions.T
        uvs = np.stack([0.3 + 4.0 * x, 2.0 * z + 4.0 * y - 0.5], axis=1).astype(np.float32)
    pose = _pose(case, t)
    mesh = _core.TriangleMesh(
        pose.moved(positions.astype(np.float64)).astype(np.float32),
        triangles,
        (normals @ pose.rotation.T).astype(np.float32),
        uvs,
        parts,
        colors,
        None if tangents is None else _turned(tangents, pose),
    )
    number = scene.add_material(material)
    scene.add_object("object", mesh, number, ["ring", "ball"])
    scene.set_environment(np.ones((2, 4, 3), np.float32), 1.0, 0.0)
    whole = np.ones(len(triangles), np.bool_)
    whole[: len(triangles) // 5] = False
    exported = ReflectorMesh(
        positions,
        normals,
        triangles,
        parts,
        whole,
        np.zeros((0, 2), np.float32) if uvs is None else uvs,
        np.zeros((0, 3), np.float32) if colors is None else colors,
        np.zeros((0, 4), np.float32) if tangents is None else tangents,
        np.zeros(len(triangles), np.uint16),
        irradiance(case, normals, 0),
        case.lightmap,
    )
    return Scene(_core.Tracer(scene, _core.TracerOptions()), exported, export_materials(scene, [number]))


def irradiance(case: Case, normals: FloatArray, sample: int) -> FloatArray:
    """Of the vertices in a sample: light from above, which turns blue on the way; red light on backs.

    Of a lightmap the texels: colours of their own, no two alike.
    """
    if case.lightmap:
        random = np.random.default_rng(1000 + (sample if case.moves else 0))
        texels = random.uniform(0.0, 3.0, (case.lightmap**2, 6 if case.open else 3))
        return texels.astype(np.float16).astype(np.float32)
    share = sample / (len(PARAMETERS) - 1) if case.moves else 0.0
    colour = np.array([1.0, 0.8, 0.6]) * (1.0 - share) + np.array([0.3, 0.5, 1.0]) * share
    values: FloatArray = ((0.5 + 0.5 * normals[:, 1:2]) * colour).astype(np.float32)
    if not case.open:
        return values
    back = ((0.6 - 0.4 * normals[:, 1:2]) * np.array([2.0 - share, 0.3, 0.1 + share])).astype(np.float32)
    return np.concatenate([values, back], axis=1)


def _eye(t: float, raised: float) -> tuple[float, float, float]:
    azimuth, elevation = math.radians(t * ARC_DEGREES), math.radians(ELEVATION + raised)
    flat = DISTANCE * math.cos(elevation)
    return flat * math.sin(azimuth), 0.1 + DISTANCE * math.sin(elevation), flat * math.cos(azimuth)


class CasePem:
    """The maps of a case as the page gets them: rounded to codes."""

    def __init__(self, projection: str = "cube", size: int = 32) -> None:
        self.projection = projection
        self.size = size
        self.code = RadianceCode.for_range(2.0, 3.6)
        # The last "sample" is the static set.
        self._maps = [
            [_maps(97 * sample + 13 * m, channels, size, projection) for m, channels in enumerate(MAPS)]
            for sample in range(len(PARAMETERS) + 1)
        ]

    @property
    def static_maps(self) -> list[FloatArray]:
        return self._maps[-1]

    def pyramid(self, sample: int, number: int) -> FloatArray:
        return self._maps[sample][number]

    def reads(self, sample: int) -> list[NDArray[np.bool_]]:
        return [np.arange(len(pyramid)) // 512 % 2 == 0 for pyramid in self._maps[sample]]

    def whole(self, sample: int, number: int) -> FloatArray:
        """A trimmed sample as the page puts it together."""
        size = self.size
        blocks = blocks_of(self.reads(sample)[number], size, self.projection)
        own = pixels_of(blocks, *atlas_shape(size, self.projection))[..., None].astype(np.uint8)
        return np.where(
            from_atlas(own, size, self.projection) > 0, self._maps[sample][number], self._maps[-1][number]
        )

    def rounded(self, code: RadianceCode, sample: int, number: int, *, trimmed: bool = False) -> FloatArray:
        pyramid = self.whole(sample, number) if trimmed else self._maps[sample][number].copy()
        pyramid[:, :3] = code.decode(code.encode(pyramid[:, :3]))
        if pyramid.shape[1] == 4:
            pyramid[:, 3] = np.rint(pyramid[:, 3] * 255.0) / 255.0
        return pyramid


def case_source(case: Case, scene: Scene, pem: CasePem) -> ExportSource:
    """The case as an exporter sees it."""
    local, distant = proxy_to_attributes(case.local), proxy_to_attributes(case.distant)
    ring = [Shell("local", local, 0, moves=case.moves, on_hull=False), Shell("distant", distant, 1)]
    if case.between is not None:
        ring.insert(1, Shell("between", proxy_to_attributes(case.between), 3))
    parts = (
        Part("ring", tuple(ring)),
        Part("ball", (Shell("distant", distant, 2 if case.between is None else 1),)),
    )
    count = len(MAPS) if case.between is not None else len(MAPS) - 1
    return ExportSource(
        parts=parts,
        space=ParameterSpace((Axis("motion" if case.moves else "arc", PARAMETERS, 0.0, 1.0),)),
        motion=MOTION if case.moves else None,
        projection=case.projection,
        maps=tuple(MapEntry(f"map {m}", case.map_size, opaque=MAPS[m] == 3) for m in range(count)),
        pyramid=pem.pyramid,
        static_maps=None if case.fade_degrees is None else tuple(pem.static_maps[:count]),
        reads=(lambda sample: pem.reads(sample)[:count]) if case.trimmed else None,
        fade_degrees=case.fade_degrees,
        still=lambda sample: np.full((HEIGHT, WIDTH, 3), 0.2 + 0.2 * sample, np.float32),
        mesh=scene.mesh,
        materials=scene.materials,
        irradiance=(lambda sample: irradiance(case, scene.mesh.normals, sample)) if case.moves else None,
        static=_maps(1234, 3, case.map_size, case.projection),
        static_proxy=distant,
        static_size=case.map_size,
        camera={
            "kind": "fixed" if case.moves else "arc",
            "target": [0.0, 0.1, 0.0],
            "radius": DISTANCE * math.cos(math.radians(ELEVATION)),
            "height": DISTANCE * math.sin(math.radians(ELEVATION)),
            "startDegrees": 0.0,
            "degrees": 0.0 if case.moves else ARC_DEGREES,
            "azimuths": [0.0, 0.0 if case.moves else ARC_DEGREES],
            "elevations": [ELEVATION, ELEVATION],
            "verticalFovDegrees": FOV,
            "aspect": WIDTH / HEIGHT,
            "pixels": HEIGHT,
        },
        origin=(0.0, 0.0, 0.0),
        run_time=run_time_attributes(case.run_time),
        title=case.name,
        notes=(),
    )


def reference(case: Case, pem: CasePem, code: RadianceCode, t: float, raised: float) -> FloatArray:
    """The C++ renderer's picture at a parameter, `raised` degrees above the samples, (H, W, 4)."""
    scene, pose = case_scene(case, t), _pose(case, t)
    eye = _eye(0.0 if case.moves else t, raised)
    camera = _core.Camera(eye, (0.0, 0.1, 0.0), vertical_fov_degrees=FOV, width=WIDTH, height=HEIGHT)
    samples = scene.tracer.trace_visibility(camera, 0, places=case.run_time.places)
    place = t * (len(PARAMETERS) - 1)
    first = min(int(place), len(PARAMETERS) - 2)
    weight = np.float32(place - first)

    fade = np.float32(1.0 if case.fade_degrees is None else fade_weight(case.fade_degrees, raised))

    def blended(number: int) -> FloatArray:
        a = pem.rounded(code, first, number, trimmed=case.trimmed)
        b = pem.rounded(code, first + 1, number, trimmed=case.trimmed)
        static = pem.rounded(code, len(PARAMETERS), number)
        return fade * ((1 - weight) * a + weight * b) + (1 - fade) * static

    local = proxy_from_attributes(moved_proxy(proxy_to_attributes(case.local), pose))
    layout = topology_of(case.projection, case.map_size)
    stacked = scene.mesh.whole_stack.astype(np.uint8)
    distant = _core.ShellMap(case.distant, layout, blended(1))
    parts = [
        [_core.ShellMap(local, layout, blended(0), stacked), distant],
        [_core.ShellMap(case.distant, layout, blended(2))],
    ]
    if case.between is not None:
        parts[0].insert(1, _core.ShellMap(case.between, layout, blended(3)))
        parts[1] = [distant]
    normals = scene.mesh.normals
    here = irradiance(case, normals, first) * (1 - weight) + irradiance(case, normals, first + 1) * weight
    uvs = scene.mesh.uvs
    if case.lightmap:
        uvs = (uvs - uvs.min(axis=0)) / np.ptp(uvs, axis=0)
    body = BodyLight(scene.mesh.triangles, uvs, case.lightmap)
    diffuse = body.radiance(samples, here.astype(np.float32))
    return _core.render_reflector(samples, parts, diffuse, case.run_time)


def write_case(case: Case, folder: Path, image_format: ImageFormat) -> None:
    """Write the export and the reference pictures of a case."""
    scene, pem = case_scene(case), CasePem(case.projection, case.map_size)
    source = case_source(case, scene, pem)
    web = WebPem(source, WebOptions(image_format))
    write_folder(web, case.name, folder, lambda done, total, text: None)
    manifest = json.loads(web.read("manifest.json"))
    code = RadianceCode(**manifest["radiance"])
    pictures: list[dict[str, Any]] = []
    places = [(0.3, 0.0)]
    if case.fade_degrees is not None:
        places += [(0.3, 6.0), (0.8, 25.0)]
    elif case.projection == "cube":
        places += [(0.0, 0.0)]
    for k, (t, raised) in enumerate(places):
        reference(case, pem, code, t, raised).astype("<f4").tofile(folder / f"reference-{k}.f32")
        pictures.append({"file": f"reference-{k}.f32", "parameter": t, "elevation": ELEVATION + raised})
    (folder / "reference.json").write_text(
        json.dumps({"width": WIDTH, "height": HEIGHT, "distance": DISTANCE, "pictures": pictures})
    )


def main(out: Path) -> None:
    for case in cases():
        write_case(case, out / case.name, ImageFormat(exact=not case.trimmed))
    write_case(cases()[1], out / "avif", ImageFormat(exact=False))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
