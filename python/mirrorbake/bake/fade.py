"""How far from its samples a PEM is better than its static set, measured on views that were held out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.static_set import stripes_of
from mirrorbake.bake.targets import ViewTracer
from mirrorbake.pem.body_light import BodyLight
from mirrorbake.pem.run_time import fade_weight, model_of, shell_maps
from mirrorbake.scene.config_axes import arranged
from mirrorbake.tone import srgb_encoded

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.sample import BakedSample, SampleBaker
    from mirrorbake.pem.store import Contents
    from mirrorbake.scene.stage import Stage

HELD_OUT = ((0.0, 3.0), (0.0, 6.0), (0.0, 12.0), (0.0, -8.0), (6.0, 0.0), (12.0, 6.0))
"""Degrees of azimuth and elevation beyond the samples; only those that do lie beyond are looked at."""
STRIPES = 4
"""Every so-manieth stripe of a view is traced."""
CANDIDATES = tuple(2.0 ** (0.5 * step) for step in range(-2, 15))
"""Degrees at which half of a PEM is left, that are tried: 0.5 to 90."""


def fit_fade(stage: Stage, contents: Contents, baker: SampleBaker) -> float:
    """Return the degrees beyond the samples at which a PEM should have faded half-way to the static set.

    One sample, at the middle of the space but at the top of its elevations, is drawn from views beyond, mixed
    with the static set by `fade_weight`. Of the candidates the one is taken whose mixtures lose the least, in
    the mean of the decibels.

    Parameters
    ----------
    stage
        Planned.
    contents
        With a static set.
    baker
        Of the samples.
    """
    assert contents.static_maps is not None
    space = contents.header.space
    places = [
        len(axis.values) - 1 if axis.name == "elevation" else len(axis.values) // 2 for axis in space.axes
    ]
    index = int(np.ravel_multi_index(places, space.shape)) if space.axes else 0
    pairs = list(held_out(stage, contents, baker.bake(index), index))
    if not pairs:
        return float(CANDIDATES[-1])

    def mean_decibels(degrees: float) -> float:
        total = 0.0
        for away, mine, static, truth in pairs:
            share = fade_weight(degrees, away)
            mixed = srgb_encoded(share * mine + (1.0 - share) * static)
            total += -10.0 * math.log10(max(float(np.mean((mixed - truth) ** 2)), 1e-12))
        return total / len(pairs)

    best: float = max(CANDIDATES, key=mean_decibels)
    return best


def held_out(
    stage: Stage, contents: Contents, baked: BakedSample, index: int
) -> Iterator[tuple[float, FloatArray, FloatArray, NDArray[np.float64]]]:
    """Draw views beyond a sample in the sample's own scene.

    Yields the degrees beyond, pixels (n, 3) from the sample's maps and from the static set, and the true ones
    as a display shows them.
    """
    header = contents.header
    point = header.space.sample(index)
    here = stage.at(point)
    pose = arranged(stage.config, header.space.scene_coordinates(point)).pose
    cameras = here.built.cameras
    place = cameras.angles_of(cameras.eye(point))
    tracer, model = ViewTracer(stage, header, contents.local_triangles), model_of(header.run_time)
    static_maps, maps, irradiance = contents.static_maps, baked.maps, baked.irradiance
    assert static_maps is not None
    body = BodyLight.of(here.built, header.lightmap)
    if irradiance is None and contents.irradiance is not None:
        irradiance = contents.irradiance[0]

    def static(part: str, shell: str) -> FloatArray:
        number = header.map_of(part, shell)
        return np.ascontiguousarray(static_maps[number][:, : header.maps[number].channels])

    sets = [
        shell_maps(header, read, pose, contents.local_triangles)
        for read in (lambda part, shell: maps[part, shell], static)
    ]
    for number, (around, up) in enumerate(HELD_OUT):
        azimuth, elevation = place[0] + around, place[1] + up
        if abs(elevation) > 85.0:
            continue
        camera = cameras.around(azimuth, elevation)
        away = cameras.degrees_outside(camera.eye)
        if away == 0.0:
            continue
        pixels: list[tuple[FloatArray, ...]] = []
        for stripe in stripes_of(tracer, here, camera, STRIPES, number % STRIPES):
            lookups, images = stripe.view.lookups, stripe.view.images
            diffuse = None
            if irradiance is not None:
                diffuse = body.radiance(lookups, irradiance)
            drawn = [np.asarray(_core.render_reflector(lookups, parts, diffuse, model)) for parts in sets]
            seen = (images.coverage > 0.99) & (drawn[0][..., 3] > 0.99)
            pixels.append((drawn[0][seen][:, :3], drawn[1][seen][:, :3], images.object[seen]))
        if not pixels:
            continue
        mine, others, truth = (np.concatenate(values) for values in zip(*pixels, strict=True))
        if len(truth):
            yield away, mine, others, srgb_encoded(truth)
