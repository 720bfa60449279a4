"""The joint display fit of a bake: maps of all shells and parts, from the pixels that will be shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.pem.pyramid import coarse_end
from mirrorbake.pem.run_time import model_of
from mirrorbake.pem.store import SolverReport

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.renderers import Draw
    from mirrorbake.bake.targets import TracedView
    from mirrorbake.pem.header import Header
    from mirrorbake.scene.config_infer import Infer
    from mirrorbake.scene.pose import Pose


@dataclass(frozen=True)
class FitView:
    """A traced view in a fit."""

    view: TracedView
    nodes: tuple[tuple[int, float], ...] = ((0, 1.0),)
    """Of the fit whose maps are blended for it, with their weights."""
    weight: float = 1.0
    """Of its pixels."""
    layer_rows: bool = True
    """Whether its layers, each by itself, have rows beside those of its pixels."""


def solve_options(infer: Infer) -> _core.SolveOptions:
    """Return the solver's settings of a scene file."""
    return _core.SolveOptions(
        **{name: getattr(infer, name) for name in _core.SOLVE_WEIGHTS},
        tolerance=infer.tolerance,
        max_iterations=infer.iterations,
    )


class DisplayFitter:
    """Fits the maps of a PEM's parts to views."""

    def __init__(self, header: Header, infer: Infer, local_triangles: NDArray[np.uint8] | None) -> None:
        self._header = header
        self._model = model_of(header.run_time)
        self._local_triangles = local_triangles
        assert infer.passes is not None, "the scene has to be planned first"
        self._options = _core.DisplayFitOptions(solve=solve_options(infer), passes=infer.passes)
        self._numbers = {entry.name: number for number, entry in enumerate(header.maps)}
        self._topologies = header.topologies
        self.probing: _core.ProbingReport | None = None
        """What probing the views of the last fit took."""

    def captured_prior(self, captured: Mapping[str, FloatArray]) -> list[FloatArray]:
        """Return RGB of each map (T, 3): of shells that are captured their pyramids, else black."""
        prior = [np.zeros((topology.texels, 3), np.float32) for topology in self._topologies]
        for part in self._header.parts:
            for shell in part.shells:
                if shell.name in captured:
                    number = self._numbers[shell.map]
                    prior[number] = coarse_end(captured[shell.name], len(prior[number]))
        return prior

    def fit(
        self, views: Sequence[FitView], pose: Pose, prior: Sequence[FloatArray] | None, nodes: int = 1
    ) -> tuple[list[list[FloatArray]], SolverReport]:
        """Fit maps.

        Parameters
        ----------
        views
            What they should show.
        pose
            Where the object is.
        prior
            RGB of each map (T, 3), to which what no view determines falls back; None: a smooth fill.
        nodes
            How many sets of maps the views blend.

        Returns
        -------
        tuple
            For each node and map (T, 4), premultiplied radiance and α; and how the last pass of the solver
            ended.
        """
        header = self._header
        shells = [
            [
                _core.FitShell(
                    shell.proxy_at(pose),
                    self._numbers[shell.map],
                    self._local_triangles if shell.polygons == "off hull" else None,
                )
                for shell in part.shells
            ]
            for part in header.parts
        ]
        texels, passes, probing = _core.fit_display(
            [
                _core.DisplayView(
                    one.view.lookups,
                    one.view.targets,
                    list(one.nodes),
                    one.weight,
                    self._split(one.view.draw),
                    one.layer_rows,
                )
                for one in views
            ],
            shells,
            self._topologies,
            nodes,
            run_time=self._model,
            options=self._options,
            prior=None if prior is None else np.concatenate([*prior] * nodes),
        )
        last = passes[-1]
        report = SolverReport(last.iterations, float(last.relative_gradient), last.converged)
        ends = np.cumsum([topology.texels for topology in self._topologies])[:-1]
        self.probing = probing
        return [np.split(maps, ends) for maps in np.split(np.asarray(texels), nodes)], report

    def _split(self, prepare: Callable[[], Draw] | None) -> Callable[[FloatArray], FloatArray] | None:
        if prepare is None:
            return None
        draw = prepare()
        ends = np.cumsum([topology.texels for topology in self._topologies])[:-1]
        return lambda texels: np.ascontiguousarray(draw(np.split(texels, ends)), np.float32)
