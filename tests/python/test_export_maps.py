"""Maps in other programs' files: orientation, levels, geometry."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.errors import OptionError
from mirrorbake.pem.export.frames import FRAMES, cube_from_levels, move_proxy, turn_cube
from mirrorbake.pem.export.map_sets import MapSet, ShellMap
from mirrorbake.pem.export.maps import export_maps
from mirrorbake.proxy import proxy_from_attributes

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

NAMES = ("+x", "-x", "+y", "-y", "+z", "-z")
INFINITE = {"shape": "infinite", "origin": [0.0, 0.0, 0.0]}


def hardware_texel(d: NDArray[Any], size: int) -> tuple[int, int, int]:
    """Face, row and column that graphics hardware reads: OpenGL 4.6, section 8.13, table 8.19."""
    x, y, z = d
    if abs(x) >= max(abs(y), abs(z)):
        face, sc, tc, ma = (0, -z, -y, x) if x > 0 else (1, z, -y, -x)
    elif abs(y) >= abs(z):
        face, sc, tc, ma = (2, x, z, y) if y > 0 else (3, x, -z, -y)
    else:
        face, sc, tc, ma = (4, x, -y, z) if z > 0 else (5, -x, -y, -z)
    column, row = (int(0.5 * (c / ma + 1.0) * size) for c in (sc, tc))
    return face, min(row, size - 1), min(column, size - 1)


def shell(pyramid: NDArray[np.float32], size: int, proxy: dict[str, Any] = INFINITE) -> ShellMap:
    return ShellMap("static", proxy, size, pyramid)


def single(of: ShellMap) -> MapSet:
    return MapSet("static", None, {"body": [of], "lid": [of]})


def labelled(size: int) -> NDArray[np.float32]:
    """A cube map each of whose texels holds its own direction, by the same table: no other can be it."""
    level = np.full((6, size, size, 3), np.nan, np.float32)
    ticks = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    for axis in range(3):
        for sign in (1.0, -1.0):
            for a in ticks:
                for b in ticks:
                    d = np.insert(np.array([a, b]), axis, sign)
                    face, row, column = hardware_texel(d, size)
                    level[face, row, column] = d
    assert np.isfinite(level).all()
    return level


# What lies in the centre and at the right edge of faces +X, +Y and +Z of the file, as directions of the
# world: three faces pin a turn or a reflection, and with them all six.
LABELS = {
    "threejs": {"+x": ("-x", "-z"), "+y": ("+y", "-x"), "+z": ("+z", "-x")},
    "unity": {"+x": ("-x", "-z"), "+y": ("+y", "-x"), "+z": ("+z", "-x")},
    "unreal": {"+x": ("+x", "-y"), "+y": ("+z", "+x"), "+z": ("+y", "+x")},
    "godot": {"+x": ("+x", "-z"), "+y": ("+y", "+x"), "+z": ("+z", "+x")},
}


def name_of(direction: NDArray[np.float32]) -> str:
    axis = int(np.argmax(np.abs(direction)))
    return ("+" if direction[axis] > 0 else "-") + "xyz"[axis]


@pytest.mark.parametrize("convention", LABELS)
def test_the_labelled_faces_lie_where_the_program_looks_for_them(convention: str, tmp_path: Path) -> None:
    maps = single(shell(np.concatenate([labelled(s).reshape(-1, 3) for s in (8, 4, 2, 1)]), 8))
    export_maps([maps], tmp_path, convention=convention, format="ktx2", precision="float32")
    cube = EnvMap.load(tmp_path / "static.ktx2")
    for face, (centre, right) in LABELS[convention].items():
        level = cube.level(0)[NAMES.index(face)]
        middle = level[3:5, 3:5].mean(axis=(0, 1))
        assert name_of(middle) == centre
        assert name_of(level[3:5, 7].mean(axis=0) - middle) == right


@pytest.mark.parametrize("convention", LABELS)
def test_a_lookup_of_the_program_reads_our_texel_exactly(convention: str) -> None:
    matrix = FRAMES[convention].lookup_matrix
    ours = labelled(8)
    theirs = turn_cube(ours, matrix)
    for d in ours.reshape(-1, 3):
        face, row, column = hardware_texel(matrix @ d.astype(np.float64), 8)
        np.testing.assert_array_equal(theirs[face, row, column], d)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize(
    ("format", "convention"),
    [("ktx2", name) for name in LABELS] + [("exr", name) for name in LABELS if name != "unreal"],
)
def test_inferred_levels_are_kept_bit_by_bit(
    convention: str, format: str, channels: int, tmp_path: Path
) -> None:
    # Each level is noise of its own: a level that was made from a finer one would differ.
    rng = np.random.default_rng(1)
    pyramid = rng.uniform(0.0, 9.0, (6 * (64 + 16 + 4 + 1), channels)).astype(np.float32)
    source = shell(pyramid, 8)
    description = export_maps(
        [single(source)], tmp_path, format=format, convention=convention, precision="float32"
    )
    files = description["sets"][0]["parts"][0]["shells"][0]["files"]
    if format == "ktx2":
        read = EnvMap.load(tmp_path / files[0])
        levels = [read.level(i) for i in range(read.levels)]
    else:
        levels = [EnvMap.load(tmp_path / name, "cube", faces="strip").level(0) for name in files]
    assert len(levels) == 4
    for number, level in enumerate(levels):
        expected = turn_cube(source.level(number), FRAMES[convention].lookup_matrix)
        np.testing.assert_array_equal(level, expected)


def test_half_files_hold_the_nearest_half_and_say_what_was_clamped(tmp_path: Path) -> None:
    pyramid = np.full((6, 3), 1.0 / 3.0, np.float32)
    pyramid[0, 0] = 1e6
    said: list[str] = []
    export_maps([single(shell(pyramid, 1))], tmp_path, convention="godot", report=said.append)
    values = EnvMap.load(tmp_path / "static.ktx2").values
    expected = np.minimum(pyramid, 65504.0).astype(np.float16).astype(np.float32)
    np.testing.assert_array_equal(values.reshape(-1, 3), expected)
    assert len(said) == 1
    assert said[0].startswith("1 values")


def panorama_direction_of_cycles(u: float, v: float) -> NDArray[np.float64]:
    """Direction in Blender's world of a place in an image, v up: the inverse of Cycles' mapping."""
    phi, theta = math.pi - 2.0 * math.pi * u, math.pi * (1.0 - v)
    return np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)])


def panorama_direction_of_unreal(u: float, v: float) -> NDArray[np.float64]:
    """The same of Unreal's long-lat importer: u = 1/2 + atan2(x, -y) / 2π, row by acos(z)."""
    phi, theta = 2.0 * math.pi * (u - 0.5), math.pi * (1.0 - v)
    return np.array([math.sin(theta) * math.sin(phi), -math.sin(theta) * math.cos(phi), math.cos(theta)])


@pytest.mark.parametrize(
    ("convention", "direction"),
    [("blender", panorama_direction_of_cycles), ("unreal", panorama_direction_of_unreal)],
)
def test_a_panorama_shows_every_direction_where_the_program_has_it(
    convention: str, direction: Any, tmp_path: Path
) -> None:
    size = 32
    coarser = [np.zeros((6 * (size >> i) ** 2, 3), np.float32) for i in range(1, 6)]
    pyramid = np.concatenate([labelled(size).reshape(-1, 3), *coarser])
    export_maps([single(shell(pyramid, size))], tmp_path, format="exr", convention=convention)
    image = EnvMap.load(tmp_path / "static.exr", "latlong").level(0)
    height, width = image.shape[:2]
    assert (height, width) == (2 * size, 4 * size)
    for u, v in [(0.5, 0.5), (0.75, 0.5), (0.3, 0.8), (0.1, 0.2), (0.9, 0.6), (0.6, 0.95)]:
        texel = image[min(int((1.0 - v) * height), height - 1), int(u * width)].astype(np.float64)
        world = FRAMES[convention].space_matrix.T @ direction(u, v)
        cosine = texel @ world / np.linalg.norm(texel)
        # A texel of the panorama is 2.8 degrees wide, one of the face as much.
        assert math.degrees(math.acos(min(cosine, 1.0))) < 4.0


@pytest.mark.parametrize("convention", FRAMES)
def test_lookups_in_the_moved_proxy_are_those_of_the_world_moved(convention: str) -> None:
    angle = 0.4
    axes = [[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]]
    common: dict[str, Any] = {"centre": [0.1, 0.7, -0.2], "axes": axes, "origin": [0.2, 0.9, -0.1]}
    proxies: list[dict[str, Any]] = [
        {"shape": "box", "half_extent": [2.0, 1.0, 3.0], **common},
        {"shape": "ellipsoid", "radii": [2.0, 1.0, 3.0], **common},
        {"shape": "hemisphere", "radius": 2.0, **common},
        {"shape": "infinite", "origin": [0.2, 0.9, -0.1]},
    ]
    rng = np.random.default_rng(3)
    position = (np.array([0.15, 0.85, -0.15]) + rng.uniform(-0.1, 0.1, (50, 3))).astype(np.float32)
    direction = rng.normal(size=(50, 3)).astype(np.float32)
    matrix = FRAMES[convention].space_matrix
    for proxy in proxies:
        world = proxy_from_attributes(proxy).lookup(position, direction)
        turn = matrix.astype(np.float32).T
        moved = proxy_from_attributes(move_proxy(proxy, matrix)).lookup(position @ turn, direction @ turn)
        # Up to the rounding of coordinates in another order.
        np.testing.assert_allclose(moved, world @ turn, rtol=0, atol=1e-5)


def test_the_description_names_every_map_in_order(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    shells = [
        ShellMap("local", {**INFINITE}, 2, rng.uniform(size=(30, 4)).astype(np.float32)),
        ShellMap("distant", {**INFINITE}, 2, rng.uniform(size=(30, 3)).astype(np.float32)),
    ]
    sets = [MapSet(f"sample-{i:04d}", (i / 2,), {"body": shells, "lid": shells[1:]}) for i in range(2)]
    returned = export_maps(iter(sets), tmp_path, convention="unity")
    read = json.loads((tmp_path / "maps.json").read_text())
    assert read == returned
    assert [s["point"] for s in read["sets"]] == [[0.0], [0.5]]
    body, lid = read["sets"][0]["parts"]
    assert [(s["name"], s["channels"], s["levels"]) for s in body["shells"]] == [
        ("local", 4, 2),
        ("distant", 3, 2),
    ]
    assert [s["name"] for s in lid["shells"]] == ["distant"]
    named = {f for s in read["sets"] for p in s["parts"] for h in p["shells"] for f in h["files"]}
    assert {path.name for path in tmp_path.iterdir()} == named | {"maps.json"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"convention": "cryengine"}, "convention = 'cryengine': expected threejs, unity,"),
        ({"format": "dds"}, "format = 'dds': expected ktx2 or exr"),
        ({"precision": "double"}, "precision = 'double': expected half or float32"),
        ({"convention": "blender", "format": "ktx2"}, "Blender reads no cube maps"),
    ],
)
def test_what_cannot_be_written_is_refused_before_a_folder_is_made(
    options: dict[str, str], message: str, tmp_path: Path
) -> None:
    with pytest.raises(OptionError, match=message):
        export_maps([], tmp_path / "out", **options)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def paraboloid_directions(size: int) -> NDArray[np.float64]:
    """Directions (2, size, size, 3) of texels' centres, of EXT_mirrorbake_pem: x / (1 + |z|) inverted."""
    ticks = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    x, y = np.meshgrid(ticks, -ticks)
    z = 1.0 - x**2 - y**2
    front = np.stack([2.0 * x, 2.0 * y, z], axis=-1) / (1.0 + x**2 + y**2)[..., None]
    return np.stack([front, front * np.array([1.0, 1.0, -1.0])])


def smooth(directions: NDArray[Any]) -> NDArray[np.float32]:
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    waves = [1.0 + 0.5 * unit[..., 0], 1.0 + 0.3 * unit[..., 1] * unit[..., 2], 1.5 + unit[..., 2]]
    return np.stack(waves, axis=-1).astype(np.float32)


def paraboloid(size: int) -> ShellMap:
    levels = [smooth(paraboloid_directions(size >> i)).reshape(-1, 3) for i in range(size.bit_length())]
    return ShellMap("static", INFINITE, size, np.concatenate(levels), "paraboloid")


@pytest.mark.parametrize("convention", LABELS)
def test_dual_paraboloids_become_cube_maps_that_lie_right(convention: str, tmp_path: Path) -> None:
    said: list[str] = []
    export_maps(
        [single(paraboloid(64))], tmp_path, convention=convention, precision="float32", report=said.append
    )
    assert said == ["the maps are no cubes: they were resampled, every level by itself"]
    description = json.loads((tmp_path / "maps.json").read_text())
    (entry,) = description["sets"][0]["parts"][0]["shells"]
    assert (entry["projection"], entry["size"], entry["levels"]) == ("cube", 64, 7)
    cube = EnvMap.load(tmp_path / "static.ktx2")
    matrix = FRAMES[convention].lookup_matrix
    for level in range(4):
        size = 64 >> level
        directions = labelled(size).astype(np.float64)
        for face in range(6):
            values = cube.level(level)[face]
            # What hardware reads with `matrix @ d` is the value of d.
            expected = smooth(directions[face] @ matrix.astype(np.float64))
            # Texels of a coarse paraboloid are up to 2/s of a radian apart from the cube's.
            assert np.abs(values - expected).max() < 3.0 / size, (level, face)


def test_a_panorama_of_a_dual_paraboloid_shows_every_direction(tmp_path: Path) -> None:
    maps = single(paraboloid(64))
    export_maps([maps], tmp_path, format="exr", convention="blender", precision="float32")
    image = EnvMap.load(tmp_path / "static.exr", "latlong").level(0)
    height, width = image.shape[:2]
    for u, v in [(0.5, 0.5), (0.75, 0.5), (0.3, 0.8), (0.1, 0.2), (0.9, 0.6), (0.6, 0.95)]:
        texel = image[min(int((1.0 - v) * height), height - 1), int(u * width)]
        world = FRAMES["blender"].space_matrix.T @ panorama_direction_of_cycles(u, v)
        np.testing.assert_allclose(texel, smooth(world), atol=0.03)


def test_a_cube_of_a_paraboloid_holds_the_levels_whose_texels_are_its_size() -> None:
    # Levels of one value each. A texel of the paraboloid is as wide as the cube's at the rim, at +X, and
    # twice as wide in its middle, at +Z.
    size = 128
    values = np.concatenate([np.full(2 * (size >> i) ** 2, i, np.float32) for i in range(8)])
    layout = _core.EnvMapLayout("dual_paraboloid", size, size, 8, 1)
    maps = EnvMap(layout, values, ["R"])
    for level in range(4):
        s = size >> level
        found = cube_from_levels(maps, s)
        assert found[0, s // 2, s // 2, 0] == pytest.approx(level, abs=0.2)
        assert found[4, s // 2, s // 2, 0] == pytest.approx(max(level - 1, 0), abs=0.2)
