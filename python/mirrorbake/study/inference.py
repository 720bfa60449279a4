"""What the inference makes of a view: decibels on it and away from it, by run time and by what is fitted."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.evaluate.metrics import psnr

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.stage import Stage

    Place = tuple[float, float]
    """Azimuth and elevation of the eye, degrees."""

PLACES = {"on": (0.0, 0.0), "+0.5°": (0.5, 0.0), "+2°": (2.0, 0.0), "+5°": (5.0, 0.0), "above": (0.0, 10.0)}
"""Where the maps are looked at, degrees from the view that they are inferred for."""

NEIGHBOUR_WEIGHT = 0.3
"""Of the views 1° to both sides in a joint fit; from 0.1 to 0.5 the decibels differ by less than 0.2."""

DOME = [(azimuth, elevation) for elevation in (10.0, 30.0) for azimuth in (-30.0, -10.0, 10.0, 30.0)]
"""Views of the static set, degrees from the view and from the horizon; that view is not among them."""

OPTIONS = _core.DisplayFitOptions(
    solve=_core.SolveOptions(
        smoothness=3e-4, level_agreement=3e-4, prior_weight=3e-4, tolerance=2e-3, max_iterations=300
    )
)
"""Of the fits: λ of 1e-3 is 0.5 dB worse on the view and 0.2 better 5° off it."""

FITS = ("one view", "with neighbours", "static set", "with neighbours, static prior")
"""What is fitted, in the order of the results; the prior of the first three is the captured map."""

_TRACE_BATCH = 4_000_000
"""Samples that are held at a time."""

_REFERENCE_SEED = 0x5EED


@dataclass(frozen=True)
class Result:
    """One way to infer maps."""

    run_time: str
    fit: str
    decibels: dict[str, float]
    """Of the object's pixels by place."""
    seconds: float
    """That the fit took, without tracing."""
    converged: bool


@dataclass
class Lab:
    """A scene's reflector seen from around a view, with traced targets and references kept."""

    stage: Stage
    view: Place
    samples: int
    """Per pixel of the targets."""
    reference_samples: int
    map_size: int
    _targets: dict[Place, _core.ViewTargets] = field(default_factory=dict)
    _references: dict[Place, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        built = self.stage.built
        self.topology = _core.TexelTopology.cube(self.map_size)
        self.parts = self._find_parts()
        self.maps = [self.topology] * (2 * len(self.parts))
        origin = self.parts[0][1][0].origin
        capture = self.stage.tracer.capture_cube(
            origin, self.map_size, [built.reflector], _core.TraceOptions(samples_per_pixel=64)
        )
        self.capture = np.asarray(_core.build_cube_pyramid(capture))

    def camera(self, place: Place) -> _core.Camera:
        """Return the camera at an azimuth and elevation, on the sphere of the scene's arc."""
        cameras = self.stage.built.cameras
        distance = math.hypot(cameras.radius, cameras.height) if cameras.kind == "arc" else cameras.radius
        return replace(cameras, kind="dome", radius=distance, height=0.0).camera(place)

    def _find_parts(self) -> list[list[tuple[_core.Proxy, int, np.ndarray | None]]]:
        built, tracer = self.stage.built, self.stage.tracer
        origin = _core.area_weighted_centroid(built.positions, built.triangles)
        trace = tracer.trace_layers(
            self.camera(self.view), built.reflector, _core.TraceOptions(samples_per_pixel=4)
        )
        distance = np.asarray(trace.samples.shells[1].hit_distance)
        seen = trace.samples
        hits = seen.position + np.array(seen.origin) + np.asarray(seen.reflection) * distance[:, None]
        far = _core.fit_box_robust(hits[np.isfinite(distance)].astype(np.float32), origin)
        off_hull = (~built.on_hull).astype(np.uint8)
        parts: list[list[tuple[_core.Proxy, int, np.ndarray | None]]] = []
        for number in range(len(built.part_names)):
            triangles = built.triangles[built.parts == number]
            centre = _core.area_weighted_centroid(built.positions, triangles)
            near = _core.fit_ellipsoid(built.positions[np.unique(triangles)], centre)
            parts.append([(near, 2 * number, off_hull), (far, 2 * number + 1, None)])
        return parts

    def _traced(self, place: Place, samples: int, seed: int) -> Iterator[tuple[int, _core.SurfaceSamples]]:
        camera = self.camera(place)
        rows = max(1, _TRACE_BATCH // (camera.width * samples))
        for y in range(0, camera.height, rows):
            options = _core.TraceOptions(
                samples_per_pixel=samples,
                seed=seed,
                window=(0, y, camera.width, min(rows, camera.height - y)),
            )
            reflector = self.stage.built.reflector
            yield y, self.stage.tracer.trace_layers(camera, reflector, options).samples

    def targets(self, place: Place) -> _core.ViewTargets:
        """Return what a view should look like."""
        if place not in self._targets:
            camera = self.camera(place)
            targets = _core.ViewTargets(camera.width, camera.height, len(self.parts), 2)
            for y, samples in self._traced(place, self.samples, self.stage.config.trace.seed):
                targets.add(samples, 0, y)
            self._targets[place] = targets
        return self._targets[place]

    def reference(self, place: Place) -> FloatArray:
        """Return mean radiance of the object and coverage, (H, W, 4), traced apart from the targets."""
        if place not in self._references:
            self._references[place] = self.picture(place, self.reference_samples, _REFERENCE_SEED)
        return self._references[place]

    def picture(self, place: Place, samples: int, seed: int) -> FloatArray:
        """Trace a view: mean radiance of the object and coverage, (H, W, 4)."""
        camera = self.camera(place)
        sums = np.zeros((camera.height * camera.width, 4))
        for y, traced in self._traced(place, samples, seed):
            pixel = np.asarray(traced.pixel).astype(np.int64) + y * camera.width
            local, distant = (np.asarray(shell.radiance) for shell in traced.shells)
            light = np.asarray(traced.diffuse) + np.asarray(traced.fresnel) * (
                local[:, :3] + (1.0 - local[:, 3:]) * distant[:, :3]
            )
            for channel in range(3):
                sums[:, channel] += np.bincount(pixel, light[:, channel], len(sums))
            sums[:, 3] += np.bincount(pixel, minlength=len(sums))
        sums[:, :3] /= np.maximum(sums[:, 3:], 1.0)
        sums[:, 3] /= samples
        return sums.reshape(camera.height, camera.width, 4).astype(np.float32)

    def lookups(self, place: Place, run_time: _core.RunTimeModel) -> _core.SurfaceSamples:
        """Return where a run time's lookups meet the object."""
        return self.stage.tracer.trace_visibility(
            self.camera(place), self.stage.built.reflector, places=list(run_time.places)
        )

    def fit(
        self,
        views: Sequence[tuple[Place, float]],
        run_time: _core.RunTimeModel,
        options: _core.DisplayFitOptions,
        prior: FloatArray | None,
    ) -> tuple[FloatArray, bool]:
        """Infer maps jointly from weighted views: RGBA of all maps, and whether the last pass converged."""
        texels, reports, _ = _core.fit_display(
            [
                _core.DisplayView(self.lookups(place, run_time), self.targets(place), weight=weight)
                for place, weight in views
            ],
            [[_core.FitShell(*shell) for shell in part] for part in self.parts],
            self.maps,
            run_time=run_time,
            options=options,
            prior=prior,
        )
        return np.asarray(texels), reports[-1].converged

    def captured_prior(self) -> FloatArray:
        """Return the captured map for the distant shells and black for the local ones."""
        pair = [np.zeros_like(self.capture), self.capture]
        return np.concatenate(pair * len(self.parts)).astype(np.float32)

    def decibels(self, texels: FloatArray, place: Place, run_time: _core.RunTimeModel) -> float:
        """Return the PSNR of what the run time draws from maps, over the object's pixels."""
        count = self.topology.texels
        parts = []
        for part in self.parts:
            shells = []
            for proxy, number, triangles in part:
                values = texels[number * count : (number + 1) * count]
                if triangles is None:
                    values = np.ascontiguousarray(values[:, :3])
                shells.append(_core.ShellMap(proxy, self.topology, values, triangles))
            parts.append(shells)
        drawn = np.asarray(_core.render_reflector(self.lookups(place, run_time), parts, run_time=run_time))
        reference = self.reference(place)
        mask = (reference[..., 3] > 0.0) & (drawn[..., 3] > 0.0)
        light = (drawn[..., :3] / np.maximum(drawn[..., 3:], 1e-9)).astype(np.float32)
        return psnr(light, reference[..., :3], mask)


def study(
    lab: Lab,
    run_times: Sequence[str],
    options: _core.DisplayFitOptions,
    progress: Callable[[str], None] = lambda text: None,
) -> list[Result]:
    """Infer the maps of one view in several ways and look at them from `PLACES`.

    Parameters
    ----------
    lab
        The scene and the view.
    run_times
        Names of run times (`run_time_model`): maps are inferred for each and drawn by it.
    options
        Of the fits.
    progress
        Told what is going on.
    """
    azimuth, elevation = lab.view
    neighbours = [((azimuth + step, elevation), NEIGHBOUR_WEIGHT) for step in (-1.0, 1.0)]
    dome = [((azimuth + place[0], place[1]), 1.0) for place in DOME]
    captured = lab.captured_prior()
    results = []
    for name in run_times:
        run_time = _core.run_time_model(name)
        static = captured
        for fit in FITS:
            progress(f"{name}: {fit}")
            views = dome if fit == "static set" else [(lab.view, 1.0)]
            if fit.startswith("with neighbours"):
                views = [*views, *neighbours]
            prior = static if fit.endswith("static prior") else captured
            for place, _ in views:
                lab.targets(place)
            start = time.perf_counter()
            texels, converged = lab.fit(views, run_time, options, prior)
            seconds = time.perf_counter() - start
            if fit == "static set":
                static = texels[:, :3].copy()
            decibels = {
                place: lab.decibels(texels, (azimuth + step[0], elevation + step[1]), run_time)
                for place, step in PLACES.items()
            }
            results.append(Result(name, fit, decibels, seconds, converged))
    return results
