"""Environment maps: conversions, mips and lookups against py360convert, skylibs, SciPy, oiiotool and maketx.

The synthetic panorama has twelve lights of 5e4, 1° to 2° wide, before a background of 0.1 to 1. For
conversions to fewer texels, and to paraboloids, the error is the relative L2 distance to the mean of the
source over each texel, by 24² places in float64; for smooth ones it is the distance to the analytic
background, without lights. A real panorama, from MIRRORBAKE_TEST_DATA, is halved before it is made larger,
so that the original is the reference.

py360convert keeps the coordinates of a conversion. "first" is what one conversion costs, with its caches
cleared; "again" is any further one of the same sizes. `kept` is a Resampler, which keeps what it knows, too:
its time is that of a further conversion, to be compared with "again".
"""

import importlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from benchmarks._build import built_program
from benchmarks._report import Case, require, run, seconds
from mirrorbake.envmap import EnvMap, Resampler
from mirrorbake.literals import ResampleFilter, SampleFilter
from mirrorbake.projection import directions_from_points, points_from_directions, texel_directions

FloatArray = NDArray[np.float32]
Convert = Callable[[], FloatArray]
PLACES = 24
# Runs of which the shortest counts: a clock that changes takes as long over ours as over theirs.
OUR_RUNS, PEER_RUNS = 25, 4
SUBSET = 32  # rows of each face that the reference looks at


def optional(name: str, package: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        print(f"bench: missing peer {name} (PyPI: {package})", file=sys.stderr)
        return None


def program(name: str) -> str | None:
    path = shutil.which(name)
    if path is None:
        print(f"bench: missing peer {name} (Debian: openimageio-tools)", file=sys.stderr)
    return path


PY360CONVERT = optional("py360convert", "py360convert")
SKYLIBS = optional("envmap", "skylibs")


def background(d: NDArray[np.floating]) -> FloatArray:
    wave = 0.55 + 0.45 * np.sin(d @ np.array([5.0, 3.0, 2.0]))
    colour: FloatArray = (wave[..., None] * np.array([1.0, 0.8, 0.6])).astype(np.float32)
    return colour


def panorama(height: int, *, lights: bool) -> EnvMap:
    d = texel_directions("latlong", 2 * height, height).astype(np.float64)
    image = background(d)
    rng = np.random.default_rng(0)
    for _ in range(12 if lights else 0):
        center = rng.normal(size=3)
        radius = np.radians(rng.uniform(0.5, 1.0))
        image[d @ (center / np.linalg.norm(center)) > np.cos(radius)] = 5e4
    return EnvMap.from_array(image, "latlong")


def real_panorama() -> EnvMap | None:
    folder = os.environ.get("MIRRORBAKE_TEST_DATA")
    if not folder or not (Path(folder) / "venice.exr").is_file():
        print("bench: no real panorama: MIRRORBAKE_TEST_DATA is not set", file=sys.stderr)
        return None
    print(f"bench: the real panorama is {Path(folder) / 'venice.exr'}", file=sys.stderr)
    return EnvMap.load(Path(folder) / "venice.exr")


def halved(envmap: EnvMap) -> EnvMap:
    image = envmap.level().astype(np.float64)
    height, width, channels = image.shape
    weight = np.cos(np.pi * ((np.arange(height) + 0.5) / height - 0.5))[:, None, None]
    pairs = (image * weight).reshape(height // 2, 2, width // 2, 2, channels).sum((1, 3))
    weights = (
        np.broadcast_to(weight, (height, width, 1)).reshape(height // 2, 2, width // 2, 2, 1).sum((1, 3))
    )
    return EnvMap.from_array((pairs / weights).astype(np.float32), "latlong")


def mean_over_texels(source: EnvMap, projection: str, size: int, rows: range) -> NDArray[np.float64]:
    """Mean of a map, texels constant, over the area of some rows of another, by many places of each texel."""
    image = source.level().reshape(-1, source.layout.height, source.layout.width, 3)
    height, width = image.shape[1:3]
    means = []
    across = (np.arange(size * PLACES) + 0.5) / (size * PLACES) * 2 - 1
    for target_face in range(6 if projection == "cube" else 2):
        for row in rows:
            down = 1 - (np.arange(row * PLACES, (row + 1) * PLACES) + 0.5) / (size * PLACES) * 2
            places = np.stack(np.meshgrid(across, down), axis=-1)
            faces = np.full(places.shape[:-1], target_face, np.int32)
            d = directions_from_points(projection, faces, places.astype(np.float32))
            # The density of solid angle.
            exponent = -1.5 if projection == "cube" else -2.0
            weight = (1 + (places**2).sum(axis=-1)) ** exponent
            face, points = points_from_directions(source.projection, d)
            column = np.minimum(((points[..., 0] + 1) / 2 * width).astype(int), width - 1)
            line = np.minimum(((1 - points[..., 1]) / 2 * height).astype(int), height - 1)
            values = image[face, line, column] * weight[..., None]
            sums = values.reshape(PLACES, size, PLACES, 3).sum((0, 2))
            means.append(sums / weight.reshape(PLACES, size, PLACES).sum((0, 2))[..., None])
    return np.stack(means).reshape(-1, len(rows), size, 3)


def mean_background(projection: str, width: int, height: int, face: int = 0) -> NDArray[np.float64]:
    """Mean of the analytic background over texels, by 4² places in each."""
    d = texel_directions(projection, 4 * width, 4 * height, face)
    places = background(d).astype(np.float64).reshape(height, 4, width, 4, 3)
    mean: NDArray[np.float64] = places.mean((1, 3))
    return mean


def relative_l2(a: NDArray[np.floating], b: NDArray[np.floating]) -> float:
    return float(np.linalg.norm(a.astype(np.float64) - b) / np.linalg.norm(b))


def as_our_cube(faces: FloatArray) -> FloatArray:
    """Bring py360convert's front, right, back, left, up, down into our order and orientation."""
    front, right, back, left, up, down = faces
    # Its front is the centre of the panorama, −Z, and its right +X; OpenGL's faces are mirrored.
    flipped = (face[:, ::-1] for face in (right, left, back, front))
    px, nx, pz, nz = flipped
    return np.stack([px, nx, up[::-1], down[::-1], pz, nz])


def their_cube(faces: FloatArray) -> list[FloatArray]:
    px, nx, py, ny, pz, nz = faces
    parts = [nz[:, ::-1], px[:, ::-1], pz[:, ::-1], nx[:, ::-1], py[::-1], ny[::-1]]
    return [np.ascontiguousarray(part) for part in parts]


def clear_py360convert() -> None:
    assert PY360CONVERT is not None
    utils = PY360CONVERT.utils
    for owner in (utils, utils.EquirecSampler, utils.CubeFaceSampler):
        for name in dir(owner):
            clear = getattr(getattr(owner, name), "cache_clear", None)
            if clear is not None:
                clear()


def first_seconds(convert: Convert, repetitions: int) -> float:
    """Shortest time with py360convert's caches cleared."""
    best = float("inf")
    for _ in range(repetitions):
        clear_py360convert()
        start = time.perf_counter()
        convert()
        best = min(best, time.perf_counter() - start)
    return best


def cross_index(size: int) -> tuple[NDArray[np.intp], ...]:
    """Rows and columns, (6, size, size) each, of our cube's texels in skylibs' vertical cross."""
    assert SKYLIBS is not None
    x, y, z, valid = SKYLIBS.EnvironmentMap(4 * size, "cube").worldCoordinates()
    rows, columns = np.nonzero(np.asarray(valid, bool))
    d = np.stack([x, y, z], axis=-1)[rows, columns].astype(np.float32)
    face, points = points_from_directions("cube", d)
    column = np.minimum(((points[:, 0] + 1) / 2 * size).astype(int), size - 1)
    row = np.minimum(((1 - points[:, 1]) / 2 * size).astype(int), size - 1)
    index = np.zeros((2, 6, size, size), np.intp)
    index[:, face, row, column] = rows, columns
    return tuple(index)


def skylibs_convert(image: FloatArray, from_: str, to: str, size: int) -> Convert:
    assert SKYLIBS is not None
    source = SKYLIBS.EnvironmentMap(image, from_)

    def convert() -> FloatArray:
        return np.asarray(source.copy().convertTo(to, size).data)

    return convert


def to_cubes(
    name: str, source: EnvMap, size: int, expected: NDArray[np.floating], rows: range, limit: float
) -> Iterator[Case]:
    """A panorama to a cube by every peer, `expected` in some rows of all faces."""
    image = source.level()
    height, width = image.shape[:2]
    part = slice(rows.start, rows.stop)

    def error(cube: FloatArray) -> float:
        return relative_l2(cube[:, part], expected)

    def ours(filter: ResampleFilter) -> Callable[[], EnvMap]:
        return lambda: source.resample("cube", size, filter=filter)

    resampler = Resampler(source, "cube", size)
    filters: tuple[ResampleFilter, ...] = ("automatic", "bilinear")
    times = {str(f): 1e3 * seconds(ours(f), OUR_RUNS) for f in filters}
    errors = {str(f): error(ours(f)().level()) for f in filters}
    times["automatic, kept"] = 1e3 * seconds(lambda: resampler.apply(source), OUR_RUNS)
    errors["automatic, kept"] = error(resampler.apply(source).level())
    require(errors["automatic"] < limit, f"{name}: relative error {errors['automatic']:.2g}")
    case = f"{name} {width}x{height} to cube {size}"
    if PY360CONVERT is not None:
        convert = PY360CONVERT.e2c

        def peer() -> FloatArray:
            return np.asarray(convert(image, size, mode="bilinear", cube_format="list"))

        error_peer = error(as_our_cube(peer()))
        first, again = 1e3 * first_seconds(peer, PEER_RUNS), 1e3 * seconds(peer, PEER_RUNS)
        for filter, our_time in times.items():
            for kind, time_peer in (("first", first), ("again", again)):
                if kind == "first" and "kept" in filter:
                    continue
                yield Case(
                    f"{case}, {filter}",
                    "ms",
                    our_time,
                    time_peer,
                    f"py360convert {kind}",
                    errors[filter],
                    error_peer,
                )
    if SKYLIBS is not None:
        peer = skylibs_convert(image, "latlong", "cube", 4 * size)
        error_peer = error(peer()[cross_index(size)])
        time_peer = 1e3 * seconds(peer, PEER_RUNS)
        for filter, our_time in times.items():
            yield Case(f"{case}, {filter}", "ms", our_time, time_peer, "skylibs", errors[filter], error_peer)


def synthetic_conversions() -> Iterator[Case]:
    source = panorama(1024, lights=True)
    rows = range(128 - SUBSET // 2, 128 + SUBSET // 2)
    yield from to_cubes("lights", source, 256, mean_over_texels(source, "cube", 256, rows), rows, 0.02)
    flux = float(np.abs(source.resample("cube", 256).flux() / source.flux() - 1).max())
    require(flux < 1e-4, f"flux of the cube is off by {flux:.2g}")
    source = panorama(1024, lights=False)
    expected = np.stack([background(texel_directions("cube", 1024, 1024, face)) for face in range(6)])
    yield from to_cubes("smooth", source, 1024, expected, range(1024), 0.02)


def real_conversions() -> Iterator[Case]:
    source = real_panorama()
    if source is None:
        return
    yield from to_cubes("real", source, 64, mean_over_texels(source, "cube", 64, range(64)), range(64), 0.05)
    rows = range(128 - SUBSET // 2, 128 + SUBSET // 2)
    expected = mean_over_texels(source, "cube", 256, rows)
    yield from to_cubes("real, halved,", halved(source), 256, expected, rows, 0.5)


def back_to_a_panorama() -> Iterator[Case]:
    cube = panorama(1024, lights=False).resample("cube", 256)
    expected = mean_background("latlong", 1024, 512)
    ours = 1e3 * seconds(lambda: cube.resample("latlong", 512), OUR_RUNS)
    error_ours = relative_l2(cube.resample("latlong", 512).level(), expected)
    require(error_ours < 0.02, f"cube to latlong: {error_ours}")
    case = "cube 256 to latlong 1024x512"
    if PY360CONVERT is not None:
        faces = their_cube(cube.level())
        convert = PY360CONVERT.c2e

        def peer() -> FloatArray:
            return np.asarray(convert(faces, 512, 1024, mode="bilinear", cube_format="list"))

        error_peer = relative_l2(peer(), expected)
        require(error_peer < 0.02, f"cube to latlong, py360convert: {error_peer}")
        for kind, time_peer in (
            ("first", first_seconds(peer, PEER_RUNS)),
            ("again", seconds(peer, PEER_RUNS)),
        ):
            yield Case(case, "ms", ours, 1e3 * time_peer, f"py360convert {kind}", error_ours, error_peer)
    if SKYLIBS is not None:
        cross = np.zeros((1024, 768, 3), np.float32)
        cross[cross_index(256)] = cube.level()
        peer = skylibs_convert(cross, "cube", "latlong", 512)
        error_peer = relative_l2(peer(), expected)
        require(error_peer < 0.05, f"cube to latlong, skylibs: {error_peer}")
        yield Case(case, "ms", ours, 1e3 * seconds(peer, PEER_RUNS), "skylibs", error_ours, error_peer)


def to_paraboloids(
    name: str, cube: EnvMap, expected: NDArray[np.floating], rows: range, limit: float
) -> Iterator[Case]:
    """A cube to paraboloids, `expected` in some rows of both."""
    size, part, source_size = 256, slice(rows.start, rows.stop), cube.layout.width
    d = np.stack([texel_directions("dual_paraboloid", size, size, face) for face in (0, 1)])

    def peer() -> FloatArray:
        face, points = points_from_directions("cube", d)
        half = source_size / 2
        line = (1 - points[..., 1]) * half - 0.5
        column = (points[..., 0] + 1) * half - 0.5
        at = np.stack([face.ravel(), line.ravel(), column.ravel()])
        channels = [
            scipy.ndimage.map_coordinates(c, at, order=1, mode="nearest")
            for c in np.moveaxis(cube.level(), -1, 0)
        ]
        return np.stack(channels, axis=-1).reshape(d.shape)

    def error(paraboloids: FloatArray) -> float:
        return relative_l2(paraboloids[:, part], expected)

    time_peer, error_peer = 1e3 * seconds(peer, PEER_RUNS), error(peer())
    filters: tuple[ResampleFilter, ...] = ("automatic", "bilinear")
    for filter in filters:

        def ours(filter: ResampleFilter = filter) -> EnvMap:
            return cube.resample("dual_paraboloid", size, filter=filter)

        error_ours = error(ours().level())
        require(filter != "automatic" or error_ours < limit, f"{name}: relative error {error_ours:.2g}")
        yield Case(
            f"{name} cube {source_size} to dual paraboloid {size}, {filter}",
            "ms",
            1e3 * seconds(ours, OUR_RUNS),
            time_peer,
            "SciPy map_coordinates, bilinear (neither peer has it)",
            error_ours,
            error_peer,
        )


def to_round_maps() -> Iterator[Case]:
    rows = range(128 - SUBSET // 2, 128 + SUBSET // 2)
    cube = panorama(1024, lights=True).resample("cube", 256)
    expected = mean_over_texels(cube, "dual_paraboloid", 256, rows)
    yield from to_paraboloids("lights,", cube, expected, rows, 0.02)
    real = real_panorama()
    if real is not None:
        cube = real.resample("cube", 128)
        expected = mean_over_texels(cube, "dual_paraboloid", 256, rows)
        yield from to_paraboloids("real,", cube, expected, rows, 0.05)
    cube = panorama(1024, lights=False).resample("cube", 256)
    expected = np.stack([mean_background("dual_paraboloid", 256, 256, face) for face in (0, 1)])
    yield from to_paraboloids("smooth,", cube, expected, range(256), 0.02)
    if SKYLIBS is None:
        return
    source = panorama(512, lights=False)
    convert = skylibs_convert(source.level(), "latlong", "angular", 512)
    x, y = np.meshgrid((np.arange(512) + 0.5) / 256 - 1, 1 - (np.arange(512) + 0.5) / 256)
    disc = x**2 + y**2 < 0.95
    expected = mean_background("angular", 512, 512)[disc]
    errors = (
        relative_l2(source.resample("angular", 512).level()[disc], expected),
        relative_l2(convert()[disc], expected),
    )
    require(max(errors) < 0.05, f"latlong to angular: {errors}")
    ours = 1e3 * seconds(lambda: source.resample("angular", 512), OUR_RUNS)
    yield Case(
        "latlong 1024x512 to angular 512", "ms", ours, 1e3 * seconds(convert, PEER_RUNS), "skylibs", *errors
    )


def lookups() -> Iterator[Case]:
    source = panorama(512, lights=False)
    cube = source.resample("cube", 256).mips()
    d = np.random.default_rng(3).normal(size=(200_000, 3)).astype(np.float32)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    image = source.level()
    height, width = image.shape[:2]

    def peer() -> FloatArray:
        x = np.arctan2(d[:, 0], -d[:, 2]) / np.pi
        y = np.arcsin(d[:, 1]) / (np.pi / 2)
        at = np.stack([(1 - y) / 2 * height - 0.5, (x + 1) / 2 * width - 0.5])
        channels = [
            scipy.ndimage.map_coordinates(image[..., c], at, order=1, mode="grid-wrap") for c in range(3)
        ]
        return np.stack(channels, axis=-1)

    expected = background(d)
    tiny = np.full_like(d, 1e-3)
    filters: tuple[SampleFilter, ...] = ("bilinear", "ewa")
    for filter in filters:

        def ours(filter: SampleFilter = filter) -> FloatArray:
            return cube.sample(d, tiny, tiny, filter=filter)

        errors = relative_l2(ours(), expected), relative_l2(peer(), expected)
        require(max(errors) < 0.02, f"{filter} lookups: {errors}")
        yield Case(
            case=f"200k {filter} lookups",
            unit="ns per lookup",
            ours=1e9 / len(d) * seconds(ours, OUR_RUNS),
            peer=1e9 / len(d) * seconds(peer, PEER_RUNS),
            peer_name="SciPy map_coordinates, bilinear",
            error_ours=errors[0],
            error_peer=errors[1],
        )


def resizing_milliseconds(oiiotool: str, path: str, target: str) -> float:
    """Shortest of several runs of oiiotool, by its own clock."""
    best = float("inf")
    for _ in range(5):
        command = [oiiotool, "--runstats", path, "--resize:filter=box", "1024x512", "-o", target]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        found = re.search(r"^\s*resize\s*:\s*([0-9.]+)", done.stdout, re.MULTILINE)
        require(found is not None, "oiiotool --runstats says nothing of resize")
        best = min(best, 1e3 * float(found[1]) if found else best)
    return best


def file_to_file() -> Iterator[Case]:
    """One process each, from an EXR file to EXR files."""
    maketx, oiiotool = program("maketx"), program("oiiotool")
    tool = str(built_program("mb-envmap", "tools"))
    source = panorama(1024, lights=True)
    with tempfile.TemporaryDirectory() as folder:
        path, ours, theirs = (str(Path(folder) / name) for name in ("panorama.exr", "ours.exr", "theirs.exr"))
        source.save(path, format="float32")

        def command_seconds(*arguments: str) -> float:
            return 1e3 * seconds(lambda: subprocess.run(arguments, check=True, capture_output=True), 3)

        if oiiotool is not None:
            expected = halved(source).level()
            time_ours = command_seconds(
                tool, "convert", path, "--to", "latlong", "--size", "512", "--format", "float32", "-o", ours
            )
            time_peer = command_seconds(oiiotool, path, "--resize:filter=box", "1024x512", "-o", theirs)
            errors = [relative_l2(EnvMap.load(p).level(), expected) for p in (ours, theirs)]
            require(max(errors) < 0.1, f"latlong to half its size: {errors}")
            yield Case(
                "latlong 2048x1024 to 1024x512, file to file",
                "ms",
                time_ours,
                time_peer,
                "oiiotool --resize, box",
                *errors,
            )
            # Most of a process loads libraries and unpacks files. What it says of resizing has two digits.
            yield Case(
                "latlong 2048x1024 to 1024x512, without files",
                "ms",
                1e3 * seconds(lambda: source.resample("latlong", 512), OUR_RUNS),
                resizing_milliseconds(oiiotool, path, theirs),
                "oiiotool --resize, its own figure",
                *errors,
            )
        if maketx is not None:
            mips = source.mips("solid_angle")
            box = source.mips("box")
            drift = [
                float(np.abs(np.array([m.flux(k) / m.flux(0) - 1 for k in range(m.levels)])).max())
                for m in (mips, box)
            ]
            time_ours = command_seconds(
                tool,
                "mips",
                path,
                "--filter",
                "solid_angle",
                "--format",
                "half",
                "-o",
                str(Path(folder) / "level{}.exr"),
            )
            time_peer = command_seconds(
                maketx, "--envlatl", "--filter", "box", "-d", "half", path, "-o", theirs
            )
            name = "maketx --envlatl (drift: of 2x2 means)"
            yield Case(
                "mips of latlong 2048x1024, file to file; error: drift of the flux",
                "ms",
                time_ours,
                time_peer,
                name,
                *drift,
            )


def cases() -> Iterator[Case]:
    yield from synthetic_conversions()
    yield from real_conversions()
    yield from back_to_a_panorama()
    yield from to_round_maps()
    yield from lookups()
    yield from file_to_file()


if __name__ == "__main__":
    run(__doc__ or "", cases)
