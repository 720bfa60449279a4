"""What an evaluation compares with ray tracing."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.opened import OpenedPem

CONTENDERS = ("pem", "static_infinite", "static_proxy")
"""What an evaluation compares with ray tracing, in the order of its tables."""

TITLES = {
    "pem": "PEM",
    "static_infinite": "Static map at infinity",
    "static_proxy": "Static map on the PEM's geometry",
}
"""How tables and pictures call the contenders."""


def render_contenders(pem: OpenedPem, t: float, samples: _core.SurfaceSamples) -> dict[str, FloatArray]:
    """Draw the reflector with every contender that exists: radiance (H, W, 3) by name."""
    names = [name for name in CONTENDERS if name != "static_proxy" or pem.run_time.has_static_proxy]
    return {name: pem.run_time.render(name, t, samples) for name in names}
