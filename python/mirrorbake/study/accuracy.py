"""How exact the numeric functions are, over their whole domain: the page docs/reference/accuracy.md.

Every figure is the largest error of a fixed set of arguments, so that a run gives what the run before gave.
`python -m mirrorbake.study.accuracy FILE` writes the table.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import fresnel, projection
from mirrorbake.evaluate.metrics import display_referred, psnr
from mirrorbake.files import write_text
from mirrorbake.pem.pyramid import join_pyramid, split_pyramid
from mirrorbake.study.accuracy_fits import accuracy_of_fits
from mirrorbake.study.accuracy_light import accuracy_of_light
from mirrorbake.study.accuracy_maps import accuracy_of_maps
from mirrorbake.study.accuracy_row import Accuracy
from mirrorbake.study.fresnel import INDICES, rounding
from mirrorbake.study.lobes import dark_room, lobe_errors, lobes, sunny_sky
from mirrorbake.study.proxy import proxy_errors
from mirrorbake.study.trade import maps

if TYPE_CHECKING:
    from numpy.typing import NDArray

PROJECTIONS = ("cube", "dual_paraboloid", "latlong", "angular", "sphere_map")
SINGULAR = {"angular", "sphere_map"}
"""Projections with one direction, away from the front, that becomes a circle."""


def accuracy(cosines: int = 60, rays: int = 6) -> list[Accuracy]:
    """Measure everything.

    Parameters
    ----------
    cosines
        Per Fresnel curve that is compared with 50 digits, half of them towards grazing.
    rays
        Per shape, flatness and depth of a proxy.
    """
    measured = [_fresnel(cosines), _proxies(rays), _projections(), _prefilter(), _display(), _storage()]
    rows = [row for rows in measured for row in rows]
    return [*rows, *accuracy_of_maps(), *accuracy_of_light(), *accuracy_of_fits()]


def _fresnel(cosines: int) -> list[Accuracy]:
    curves = rounding(cosines)
    rows = []
    for kind, name in (("n = ", "`fresnel.dielectric`"), (", green", "`fresnel.conductor`")):
        for dtype in ("float32", "float64"):
            error = max(
                curve["share_of_allowance"]
                for curve in curves
                if kind in curve["material"] and curve["dtype"] == dtype
            )
            domain = "c 0…1, n 0.3…200" if kind == "n = " else "c 0…1, every metal of the library"
            allowance = "1e-7" if dtype == "float32" else "1e-15"
            unit = f"of 4 ulp + {allowance}"
            rows.append(Accuracy(f"{name} {dtype}", domain, "50 digits", unit, error, 1.0))
    c = np.linspace(0.0, 1.0, 20001)
    worst = 0.0
    for index in (1.33, 1.5, 2.0, 2.4):
        model = fresnel.Dielectric(index)
        worst = max(worst, float(np.abs(fresnel.Schlick(float(model(1.0)))(c) - model(c)).max()))
    rows.append(
        Accuracy("Schlick's approximation", "c 0…1, n 1.33…2.4", "`fresnel.dielectric`", "", worst, 0.09)
    )
    worst = 0.0
    for index in INDICES[4:]:
        model = fresnel.Dielectric(index)
        table = fresnel.table_for_error(model, 1e-3)
        worst = max(worst, float(np.abs(table(c.astype(np.float32)) - model(c)).max()))
    rows.append(
        Accuracy("`fresnel.table_for_error`, 1e-3", "c 0…1, n 1.33…200", "the model", "", worst, 1.01e-3)
    )
    return rows


def _proxies(rays: int) -> list[Accuracy]:
    errors = proxy_errors(rays)
    rows = []
    for shape in ("box", "ellipsoid", "hemisphere"):
        for dtype, bound in (("float32", 2e-7), ("float64", 1e-13)):
            found = [e.largest for e in errors if e.shape == shape and e.arithmetic == f"mirrorbake {dtype}"]
            if found:
                domain = "inside, up to its wall; as flat as 1:1000"
                name = f"`Proxy.{shape}(…).lookup` {dtype}"
                rows.append(Accuracy(name, domain, "50 digits", "rad", max(found), bound))
    return rows


def _directions(count: int) -> NDArray[np.float32]:
    random = np.random.default_rng(7)
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # Seams, edges and corners, from both sides.
    special = np.array(
        [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)],
        float,
    )
    return np.concatenate([directions, special / np.linalg.norm(special, axis=1, keepdims=True)]).astype(
        np.float32
    )


def _projections() -> list[Accuracy]:
    rows = []
    d = _directions(20000)
    for name in PROJECTIONS:
        # The direction that becomes a circle has no place of its own.
        chosen = d[d[:, 2] > -0.999] if name in SINGULAR else d
        faces, points = projection.points_from_directions(name, chosen)
        back = projection.directions_from_points(name, faces, points)
        cross = np.linalg.norm(np.cross(back.astype(float), chosen.astype(float)), axis=1)
        dot = np.sum(back.astype(float) * chosen, axis=1)
        error = float(np.nanmax(np.arctan2(cross, dot)))
        domain = (
            "all directions but within 2.6° of the singular one" if name in SINGULAR else "all directions"
        )
        rows.append(
            Accuracy(f"`{name}`, to points and back", domain, "the direction", "rad", error, _BOUNDS[name])
        )
    for name, width, height in (("cube", 64, 64), ("cube", 1024, 1024), ("latlong", 256, 128)):
        angles = projection.texel_solid_angles(name, width, height)
        total = float(angles.sum()) * (6 if angles.size == width * height and name == "cube" else 1)
        error = abs(total / (4.0 * math.pi) - 1.0)
        rows.append(
            Accuracy(f"`texel_solid_angles`, `{name}`", f"{width}×{height}", "their sum 4π", "", error, 1e-12)
        )
    return rows


_BOUNDS = {"cube": 2e-7, "dual_paraboloid": 3e-7, "latlong": 3e-7, "angular": 5e-7, "sphere_map": 5e-6}


def _prefilter() -> list[Accuracy]:
    """Of a sun and of lamps; cosine lobes are sums over all texels as they are, others over cells."""
    rows = []
    sources = (sunny_sky(128), dark_room(128))
    for name, (lobe, weight) in lobes().items():
        if name == "Phong N = 10000":  # narrower than these texels, which it would cut up
            continue
        errors = [lobe_errors(source, lobe, weight) for source in sources]
        exact = name in {"diffuse", "Phong N = 1", "GGX α = 1"}
        error = max(float(found.max() if exact else np.percentile(found, 99)) for found in errors)
        unit, bound = ("relative", 1e-6) if exact else ("relative, 99th percentile", 5e-3)
        rows.append(
            Accuracy(
                f"`Prefilter`, {name}", "a sun, lamps of 1e5", "all texels in float64", unit, error, bound
            )
        )
    return rows


def _display() -> list[Accuracy]:
    shown = np.linspace(0.0, 1.0, 4096)
    linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
    error = float(np.abs(display_referred(linear) - shown).max())
    rows = [Accuracy("`display_referred`", "0…1", "its inverse (IEC 61966-2-1)", "", error, 1e-15)]
    random = np.random.default_rng(3)
    grey = np.full((200, 300, 3), 0.5)
    worst = 0.0
    for sigma in (1e-3, 1e-2, 5e-2):
        noisy = grey + random.normal(scale=sigma, size=grey.shape)
        images = [(((value + 0.055) / 1.055) ** 2.4).astype(np.float32) for value in (noisy, grey)]
        value = psnr(images[0], images[1], np.ones(grey.shape[:2], bool))
        worst = max(worst, abs(value + 20.0 * math.log10(sigma)))
    rows.append(Accuracy("`psnr`", "noise of 0.001…0.05, 180,000 values", "-20 log10 σ", "dB", worst, 0.05))
    return rows


def _storage() -> list[Accuracy]:
    size = 32
    random = np.random.default_rng(5)
    texels = 6 * sum((size >> level) ** 2 for level in range(size.bit_length()))
    light = (10.0 ** random.uniform(-4.0, 4.0, (texels, 3))).astype(np.float32)
    finest, residuals, _ = split_pyramid(light, size, "float16")
    stored = join_pyramid(finest, residuals)
    first = slice(0, 6 * size * size)
    relative = float((np.abs(stored[first] - light[first]) / light[first]).max())
    rows = [
        Accuracy("finest level in `float16`", "1e-4…1e4", "the value", "relative", relative, 2.0**-11 + 1e-6)
    ]
    # A residual is off by the rounding of the level's own size, at worst of its largest texel beneath.
    coarse = slice(6 * size * size, None)
    error = float((np.abs(stored[coarse] - light[coarse]) / light.max()).max())
    rows.append(
        Accuracy("coarser levels in `float16`", "1e-4…1e4", "the value", "of the largest", error, 2.0**-11)
    )
    coded = maps.STORAGES[0].apply(light)
    step = (math.log2(float(light.max()) + maps.LOG_FLOOR) - math.log2(maps.LOG_FLOOR)) / 255
    octaves = np.log2(coded + maps.LOG_FLOOR) - np.log2(light + maps.LOG_FLOOR)
    error = float(np.abs(octaves).max()) / step
    rows.append(Accuracy("8-bit logarithmic code", "1e-4…1e4", "the value", "of a step", error, 0.51))
    return rows


def table(rows: list[Accuracy]) -> str:
    """Return the rows as a Markdown table."""
    lines = [
        "| function | domain | compared with | largest error | allowed |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {row.function} | {row.domain} | {row.against} | {row.error:.2g} {row.unit} | {row.bound:.2g} |"
        for row in rows
    ]
    return "\n".join(lines) + "\n"


PREFACE = """# Accuracy

What the numeric functions are off by, over their whole domain: the largest error of a fixed set of
arguments with the extremes among them. This page is made by
`python -m mirrorbake.study.accuracy docs/reference/accuracy.md`; a test measures every row again and holds
it to what is allowed. Curves: [Fresnel reflectance](fresnel.md), [proxy geometry](proxies.md). Errors of
resampling and of mip levels depend on the map: [environment maps](../guide/environment-maps.md); those of
prefiltered photographs are [with these](../guide/prefiltering.md#what-is-computed). The light of the tracer
and of evaluations has noise, which is
[measured with it](../adr/0080-references-apart-from-targets.md).

"""

REST = """
Whole bakes are tested at heights of 1 mm and 1 km, far from the zero of the world, of one triangle and of a
needle, at fields of view of 1° and 170°, in one pixel, from a grazing view, under black and a million times
as bright surroundings; solves over regularisers of 1 to 1e-8 (conditions up to 1e8), beside float64, and
targets over ten orders of magnitude; two million triangles from tracing to the map. A solve that did not
reach its tolerance says so (`SolveReport.converged`); traced samples that are NaN or infinite are left out,
counted (`ViewTargets.rejected`) and reported by the bake.
"""


def main(path: Path) -> None:
    """Write the page."""
    write_text(path, PREFACE + table(accuracy()) + REST)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
