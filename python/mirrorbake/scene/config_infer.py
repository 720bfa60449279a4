"""The section [infer] of a scene file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from mirrorbake.scene.config_values import AUTO, Section


class Infer(Section):
    """[infer]: how the maps are solved for."""

    fit: Literal["layers", "display"] = "display"
    """`display`: all shells and parts together, to the pixels that `run_time` will show, as a display shows
    them. `layers`: every shell by itself, to the light that it holds, as [PEM] §4 does."""
    run_time: Literal["Web", "Web1", "Reference"] = "Web"
    """What draws the maps of fit = "display": 4 lookups a pixel with up to 4 taps, as the page does; one
    lookup; 16 lookups."""
    matrix: Literal["analytic", "probed"] = "analytic"
    """How it is known what a pixel reads: `analytic`, by the formula of `run_time`; `probed`, from pictures
    that `renderer` draws."""
    renderer: str | None = None
    """Of matrix = "probed": the name of a renderer that is registered, or an entry point of an installed
    package."""
    passes: Annotated[Annotated[int, Field(ge=1, le=16)] | None, *AUTO] = None
    """Of fit = "display": how often its weights are taken from the fit's own image. "auto": by
    `auto.quality`."""
    neighbours: Annotated[Annotated[float, Field(ge=0, le=1)] | None, *AUTO] = None
    """Of fit = "display": weight of the neighbouring samples' views in the fit of a sample. "auto": 0.3 where
    they are close, by `auto.quality`."""
    smoothness: Annotated[Annotated[float, Field(ge=0, le=1e6)] | None, *AUTO] = 1e-4
    """Weight λ of differences between neighbouring texels: small fits the sampled view best, large lasts away
    from it. "auto": by what is held out; `level_agreement` and `prior_weight` are scaled alike then."""
    level_agreement: Annotated[float, Field(ge=0, le=1e6)] = 1e-4
    """Weight λ of a texel's difference from the mean of the four below it in the pyramid."""
    prior: Literal["smooth", "captured"] = "captured"
    """What the distant map's texels that a view does not determine fall back to: a smooth fill, or the
    captured surroundings."""
    prior_weight: Annotated[float, Field(ge=0, le=1e6)] = 1e-4
    """Weight λ of the difference from the captured surroundings."""
    footprint_scale: Annotated[float, Field(gt=0, le=4)] = 0.25
    """Size of a lookup's footprint in pixels: 1 filters as graphics hardware does for one sample per pixel,
    less is sharper for supersampled images."""
    iterations: Annotated[int, Field(ge=0, le=100_000)] = 600
    """At most, per layer and view."""
    tolerance: Annotated[float, Field(gt=0, lt=1)] = 3e-2
    """The solver stops when its gradient has shrunk to this fraction."""

    @model_validator(mode="after")
    def _probed_has_a_renderer(self) -> Infer:
        if (self.matrix == "probed") != (self.renderer is not None):
            raise ValueError('`matrix = "probed"` and `renderer` need each other')
        if self.matrix == "probed" and self.fit == "layers":
            raise ValueError('`matrix = "probed"` needs fit = "display"')
        return self
