"""Environment maps: conversions, mips and lookups against py360convert, SciPy and maketx.

The panorama has twelve lights of 5e4, 1° to 2° wide, before a background of 0.1 to 1. For conversions to
fewer texels the error is the relative L2 distance to the mean of the panorama over each texel, by 24² places
in float64; for conversions to more texels it is the distance to the analytic background, without lights.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import py360convert
import scipy.ndimage
from numpy.typing import NDArray

from benchmarks._report import Case, require, run, seconds
from mirrorbake.envmap import EnvMap
from mirrorbake.projection import points_from_directions, texel_directions

FloatArray = NDArray[np.float32]
PLACES = 24
SUBSET = 32  # rows of each face that the reference looks at


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


def mean_over_texels(source: EnvMap, size: int, face: int, rows: range) -> NDArray[np.float64]:
    """Mean of a panorama over the area of some texels of a cube map, by many places of each."""
    image = source.level()
    height, width = image.shape[:2]
    wide = size * PLACES
    d = texel_directions("cube", wide, wide, face)[rows.start * PLACES : rows.stop * PLACES]
    # The density of solid angle on a face is the cube of the normalised direction's largest component.
    weight = np.abs(d).max(axis=-1).astype(np.float64) ** 3
    _, points = points_from_directions("latlong", d)
    column = np.minimum(((points[..., 0] + 1) / 2 * width).astype(int), width - 1)
    row = np.minimum(((1 - points[..., 1]) / 2 * height).astype(int), height - 1)
    values = image[row, column] * weight[..., None]
    shape = (len(rows), PLACES, size, PLACES)
    total: NDArray[np.float64] = values.reshape(*shape, 3).sum((1, 3))
    mean: NDArray[np.float64] = total / weight.reshape(shape).sum((1, 3))[..., None]
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


def conversions() -> Iterator[Case]:
    source = panorama(1024, lights=True)
    for size in (256, 1024):
        shrinks = size == 256
        if not shrinks:
            source = panorama(1024, lights=False)
        image = source.level()

        def convert(source: EnvMap = source, size: int = size) -> EnvMap:
            return source.resample("cube", size)

        def peer(image: FloatArray = image, size: int = size) -> FloatArray:
            return np.asarray(py360convert.e2c(image, size, mode="bilinear", cube_format="list"))

        ours = convert().level()
        theirs = as_our_cube(peer())
        if shrinks:
            middle = range(size // 2 - SUBSET // 2, size // 2 + SUBSET // 2)
            expected = np.stack([mean_over_texels(source, size, face, middle) for face in range(6)])
            ours, theirs = (cube[:, middle.start : middle.stop] for cube in (ours, theirs))
        else:
            expected = np.stack([background(texel_directions("cube", size, size, face)) for face in range(6)])
        errors = relative_l2(ours, expected), relative_l2(theirs, expected)
        require(errors[0] < 0.02, f"cube of {size}: relative error {errors[0]:.2g}")
        yield Case(
            case=f"latlong 2048x1024 to cube {size}",
            unit="ms",
            ours=1e3 * seconds(convert, 3),
            peer=1e3 * seconds(peer, 2),
            peer_name="py360convert e2c, bilinear",
            error_ours=errors[0],
            error_peer=errors[1],
        )


def back_to_a_panorama() -> Iterator[Case]:
    cube = panorama(1024, lights=False).resample("cube", 256)
    theirs_in = [np.ascontiguousarray(f) for f in _their_cube(cube.level())]
    expected = background(texel_directions("latlong", 1024, 512))

    def peer() -> FloatArray:
        return np.asarray(py360convert.c2e(theirs_in, 512, 1024, mode="bilinear", cube_format="list"))

    errors = relative_l2(cube.resample("latlong", 512).level(), expected), relative_l2(peer(), expected)
    require(max(errors) < 0.02, f"cube to latlong: {errors}")
    yield Case(
        case="cube 256 to latlong 1024x512",
        unit="ms",
        ours=1e3 * seconds(lambda: cube.resample("latlong", 512), 3),
        peer=1e3 * seconds(peer, 2),
        peer_name="py360convert c2e, bilinear",
        error_ours=errors[0],
        error_peer=errors[1],
    )


def _their_cube(faces: FloatArray) -> list[FloatArray]:
    px, nx, py, ny, pz, nz = faces
    return [nz[:, ::-1], px[:, ::-1], pz[:, ::-1], nx[:, ::-1], py[::-1], ny[::-1]]


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
    for filter in ("bilinear", "ewa"):

        def ours(filter: str = filter) -> FloatArray:
            return cube.sample(d, tiny, tiny, filter=filter)

        errors = relative_l2(ours(), expected), relative_l2(peer(), expected)
        require(max(errors) < 0.02, f"{filter} lookups: {errors}")
        yield Case(
            case=f"200k {filter} lookups",
            unit="ns per lookup",
            ours=1e9 / len(d) * seconds(ours, 3),
            peer=1e9 / len(d) * seconds(peer, 3),
            peer_name="SciPy map_coordinates, bilinear",
            error_ours=errors[0],
            error_peer=errors[1],
        )


def mip_chain() -> Iterator[Case]:
    if shutil.which("maketx") is None:
        print("bench: without maketx (Debian: openimageio-tools)", file=sys.stderr)
        return
    source = panorama(1024, lights=True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "panorama.exr"
        source.save(path, format="float32")
        command = ["maketx", "--envlatl", "--filter", "box", str(path), "-o", str(Path(folder) / "mips.exr")]

        def peer() -> None:
            subprocess.run(command, check=True, capture_output=True)

        def ours() -> None:
            mips = EnvMap.load(path).mips("solid_angle")
            for level in range(mips.levels):
                one = EnvMap.from_array(mips.level(level), "latlong")
                one.save(Path(folder) / f"level{level}.exr")

        mips = source.mips("solid_angle")
        drift = max(float(np.abs(mips.flux(k) / mips.flux(0) - 1).max()) for k in range(mips.levels))
        box = source.mips("box")
        peer_drift = max(float(np.abs(box.flux(k) / box.flux(0) - 1).max()) for k in range(box.levels))
        yield Case(
            case="mips of latlong 2048x1024, file to file; error: drift of the flux",
            unit="ms",
            ours=1e3 * seconds(ours, 2),
            peer=1e3 * seconds(peer, 2),
            peer_name="maketx --envlatl (drift: of 2x2 means)",
            error_ours=drift,
            error_peer=peer_drift,
        )


def cases() -> Iterator[Case]:
    yield from conversions()
    yield from back_to_a_panorama()
    yield from lookups()
    yield from mip_chain()


if __name__ == "__main__":
    run(__doc__ or "", cases)
