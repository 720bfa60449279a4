"""The accuracy study of proxy lookups: its bounds are what spec G2 asks for."""

import json
from pathlib import Path

from mirrorbake.study.proxy import as_json, plot, proxy_errors


def test_lookups_are_within_float_rounding_of_50_digits(tmp_path: Path) -> None:
    errors = proxy_errors(samples=4, depths=(1e-1, 1e-4, 1e-6))
    # Three float32 components of one vector, each half an ulp off: 6e-8 · √2 at most.
    float32 = [e.largest for e in errors if e.arithmetic == "mirrorbake float32"]
    assert len(float32) >= 24
    assert max(float32) < 1e-7
    # In float64 the ellipsoid's roots lose digits next to the wall: 1e-16 / √1e-6 and the aspect ratio.
    float64 = [e.largest for e in errors if e.arithmetic == "mirrorbake float64"]
    assert len(float64) == 42  # 2 shapes × 2 × 3 aspects × 3 depths, and 2 × 3 of the hemisphere
    assert max(float64) < 1e-11
    assert {e.shape for e in errors} >= {"box", "ellipsoid", "hemisphere", "rotated hemisphere"}
    assert json.loads(json.dumps(as_json(errors)))["errors"][0]["shape"] == "box"
    plot(errors, tmp_path / "proxy.png")
    assert (tmp_path / "proxy.png").stat().st_size > 10_000
