"""A scene may be of any size, and anywhere: a bake's numbers are relative to a zero of its own."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import mirrorbake as mb
from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.evaluate import Onlooker
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.evaluate.places import choose_views
from mirrorbake.pem.export.glb import export_glb
from mirrorbake.pem.export.map_sets import sample_set
from mirrorbake.pem.export.maps import export_maps
from mirrorbake.pem.export.source import export_source
from mirrorbake.pem.export.web import MANIFEST_NAME, WebPem
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.render import picture_of
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.proxy import Proxy
from mirrorbake.scene.build import build_scene
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

# What the teapot of 0.15 m mirrors, in units of its height: a floor and posts around it.
BOXES = [
    ((-9, -1, -9), (9, 0, 9), "grey"),
    ((-5, 0, -6), (-3, 4, -5), "red"),
    ((2, 0, -5), (4, 6, -4), "green"),
    ((4, 0, 2), (5, 3, 5), "blue"),
    ((-5, 0, 3), (-4, 5, 4), "red"),
    ((-1, 0, 5), (2, 3, 6), "green"),
]
TRIVIAL = (0.0, 0.0, 0.0)
FAR = {"10 km away": (1e4, -25.5, -3e3), "100 km away": (-1e5, 1234.25, 7e4)}
SIZES = {"1 mm": 1e-3, "1 km": 1e3}


def add_box(lines: list[str], name: str, material: str, at: NDArray[np.float64], low: Any, high: Any) -> None:
    """Add a box to an OBJ file, its corners in double precision."""
    first = sum(line.startswith("v ") for line in lines) + 1
    lines.append(f"o {name}\nusemtl {material}")
    for corner in range(8):
        place = [at[k] + (high if corner >> k & 1 else low)[k] for k in range(3)]
        lines.append("v " + " ".join(f"{x:.17g}" for x in place))
    for face in ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)):
        lines.append("f " + " ".join(str(first + index) for index in face))


@dataclass(frozen=True)
class World:
    """A scene and its bake."""

    pem: OpenedPem
    decibels: float
    """Of the PEM against a ray-traced picture half-way between its samples."""
    picture: NDArray[np.float32]
    maps: NDArray[np.float32]


def scene(folder: Path, at: tuple[float, float, float], height: float, reflector: str) -> dict[str, Any]:
    """A scene file of a teapot among boxes, both at a place of the file's world."""
    folder.mkdir(exist_ok=True)
    lines = ["mtllib boxes.mtl"]
    for number, (low, high, material) in enumerate(BOXES):
        add_box(
            lines, f"box{number}", material, np.array(at), height * np.array(low), height * np.array(high)
        )
    if reflector == "object of the file":
        add_box(lines, "mirror", "grey", np.array(at), height * np.array((-0.6, 0.0, -0.4)),
                height * np.array((0.6, 1.0, 0.4)))  # fmt: skip
    (folder / "boxes.obj").write_text("\n".join(lines) + "\n")
    (folder / "boxes.mtl").write_text(
        "".join(
            f"newmtl {name}\nKd {kd}\nillum 1\n"
            for name, kd in (("grey", "0.5 0.5 0.5"), ("red", "0.8 0.1 0.1"), ("green", "0.1 0.7 0.2"),
                             ("blue", "0.1 0.2 0.8"))
        )
    )  # fmt: skip
    v, u = np.mgrid[0:16, 0:32].astype(np.float32)
    sky = np.stack([0.5 + u / 64, 1 - v / 32, 1 - u / 64], axis=-1)
    mb.save_image(str(folder / "sky.exr"), np.ascontiguousarray(sky), ["R", "G", "B"], format="float32")
    what: dict[str, Any] = {"scene_object": "mirror"}
    if reflector == "teapot":
        what = {
            "object": "teapot",
            "subdivisions": 6,
            "height": height,
            "position": list(at),
            "parts": "joined",
        }
    return {
        "reflector": what,
        "material": {},
        "surroundings": {"scene": str(folder / "boxes.obj"), "panorama": str(folder / "sky.exr")},
        "views": {"count": 2, "degrees": 2.0, "start": 22.0, "size": [64, 48]},
        "layers": {"diffuse": False},
        "maps": {"size": 32, "distant": "box"},
        "trace": {"samples": 16, "depth": 2, "indirect": "none"},
        "auto": {"quality": "draft"},
        # Texels that few rays see follow the roundings the less, the more their neighbours hold them.
        "infer": {"smoothness": 3e-4, "level_agreement": 3e-4, "prior_weight": 3e-4, "tolerance": 1e-3},
    }


def baked(
    folder: Path, at: tuple[float, float, float] = TRIVIAL, height: float = 0.15, reflector: str = "teapot"
) -> World:
    config = parse_config(scene(folder, at, height, reflector), "far")
    bake(config, folder / "pem")
    pem = open_pem(folder / "pem")
    picture, traced = picture_of(pem, 0.5), images_of_trace(pem.stage.trace(0.5))
    decibels = psnr(traced.beauty, picture, traced.coverage > 0.0)
    maps = np.concatenate([pem.store.read_map(*name, 0).ravel() for name in pem.store.header.map_names()])
    return World(pem, decibels, picture, maps)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> World:
    return baked(tmp_path_factory.mktemp("home"))


def assert_same(world: World, home: World, pixels: float, texels: float) -> None:
    """Compare two bakes of what should be one scene but for roundings.

    Rounding sends a few of a pixel's rays past an edge: `pixels` bounds the share of pixels that change by a
    thousandth of the range, and the decibels agree to 0.3. Texels that few rays see, or none, follow what the
    solver stops at: the maps agree to `texels` of their range, root mean square.
    """
    assert world.decibels == pytest.approx(home.decibels, abs=0.3)
    for ours, theirs in ((world.picture, home.picture), (world.maps, home.maps)):
        assert np.isfinite(ours).all()
        difference = np.abs(ours - theirs) / np.percentile(theirs, 99.0)
        if ours is world.picture:
            assert np.mean(difference > 1e-3) < pixels
        else:
            assert np.sqrt(np.mean(difference**2)) < texels


@pytest.mark.parametrize("place", FAR)
def test_a_bake_far_from_the_worlds_zero_is_that_at_home(tmp_path: Path, home: World, place: str) -> None:
    world = baked(tmp_path, FAR[place])
    assert world.pem.store.header.origin == FAR[place]
    # Differences of coordinates that doubles hold to 1e-11 round to the same floats but for a few.
    assert_same(world, home, 0.02, 0.002)


@pytest.mark.parametrize("size", SIZES)
def test_a_bake_of_any_size_among_things_is_that_at_home(tmp_path: Path, home: World, size: str) -> None:
    assert_same(baked(tmp_path, height=SIZES[size]), home, 0.05, 0.0075)


def test_a_reflector_that_its_file_has_far_away_is_baked_about_its_own_middle(tmp_path: Path) -> None:
    near = baked(tmp_path / "near", reflector="object of the file")
    far = baked(tmp_path / "far", (1e5, 1234.0, -7e4), reflector="object of the file")
    np.testing.assert_allclose(far.pem.store.header.origin, (1e5, 1234.075, -7e4), atol=0.01)
    assert near.pem.store.header.origin == TRIVIAL
    # The middle is that of the rounded file, so that all coordinates differ in their last bits.
    assert_same(far, near, 0.1, 0.05)


def test_a_mesh_that_its_file_has_far_away_keeps_its_shape(tmp_path: Path) -> None:
    def built(at: tuple[float, float, float], *, materials: bool) -> NDArray[np.float32]:
        lines: list[str] = []
        add_box(lines, "box", "m", np.array(at), np.array((0.0, 0.0, 0.0)), np.array((1.1, 2.0, 3.3)))
        (tmp_path / "m.obj").write_text("\n".join(lines) + "\n")
        section: dict[str, Any] = {} if materials else {"material": {}}
        config = {"reflector": {"mesh": str(tmp_path / "m.obj"), "height": 2.0}, **section}
        return build_scene(parse_config(config, "mesh")).positions

    for materials in (False, True):
        near, far = (built(at, materials=materials) for at in (TRIVIAL, (5e5, 120.0, 5e6)))
        # Doubles at 5e6 hold 1e-9.
        np.testing.assert_allclose(far, near, atol=2e-9)


def test_lookups_far_away_keep_their_accuracy(tmp_path: Path) -> None:
    # World-space floats were off by 4.5 mrad at 1e4 m and 37 mrad at 1e5 m.
    def seen(folder: Path, at: tuple[float, float, float]) -> NDArray[np.float64]:
        built = build_scene(parse_config(scene(folder, at, 0.15, "teapot"), "far"))
        options = mb.TraceOptions(samples_per_pixel=1)
        found = mb.Tracer(built.scene).trace_visibility(
            built.cameras.camera((0.5,)), built.reflector, options, [(0.5, 0.5)]
        )
        box = Proxy.box((0, 0.4, 0), (1, 0.5, 1), (0, 0.1, 0))
        h = box.lookup_float64(found.position + np.array(found.origin), np.asarray(found.reflection, float))
        unit: NDArray[np.float64] = h / np.linalg.norm(h, axis=1, keepdims=True)
        return unit

    expected = seen(tmp_path / "a", TRIVIAL)
    for number, at in enumerate(FAR.values()):
        found = seen(tmp_path / f"b{number}", at)
        assert found.shape == expected.shape
        assert np.quantile(np.linalg.norm(found - expected, axis=1), 0.99) < 1e-5


def test_figures_and_exports_of_a_bake_far_away_are_those_at_home(tmp_path: Path, home: World) -> None:
    at = FAR["100 km away"]
    world = baked(tmp_path, at)
    # References are traced anew, with other random numbers.
    seen = [
        Onlooker(w.pem, only=("pem",)).look(choose_views(w.pem.stage.built.cameras, w.pem.space)[0])
        for w in (home, world)
    ]
    figures = [s.reference.psnr(next(iter(s.pictures["pem"].values()))) for s in seen if s is not None]
    assert figures[1] == pytest.approx(figures[0], abs=0.3)
    manifests = [json.loads(WebPem(export_source(w.pem)).read(MANIFEST_NAME)) for w in (home, world)]
    assert manifests[0]["origin"] == [0, 0, 0]
    assert manifests[1]["origin"] == list(at)
    for key in ("mesh", "parts", "camera"):
        ours, theirs = (json.dumps(manifest[key]) for manifest in manifests)
        numbers = [[float(x) for x in _numbers(json.loads(text))] for text in (ours, theirs)]
        # The page computes in floats about the zero of the PEM.
        np.testing.assert_allclose(numbers[0], numbers[1], atol=1e-5)
    export_glb(world.pem.store, world.pem.stage.built, tmp_path / "far.glb")
    loaded = mb.load_scene(tmp_path / "far.glb", origin=at).scene
    mesh = np.asarray(loaded.object_mesh(0).positions)
    np.testing.assert_allclose(mesh.min(axis=0), home.pem.stage.built.positions.min(axis=0), atol=1e-6)
    described = export_maps(
        [sample_set(world.pem.store, 0)],
        tmp_path / "maps",
        convention="unity",
        origin=world.pem.store.header.origin,
    )
    assert described["origin"] == [-at[0], at[1], at[2]]


def _numbers(value: Any) -> list[float]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [x for item in value for x in _numbers(item)]
    return [float(value)] if isinstance(value, (int, float)) and not isinstance(value, bool) else []
