"""Films and stills of a PEM, decoded again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import av
import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.errors import InputError, OptionError
from mirrorbake.pem.export.video import export_stills, export_video, walk
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.render import render
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.parameters import Axis, ParameterSpace
from mirrorbake.tone import displayed, srgb_bytes

if TYPE_CHECKING:
    from pathlib import Path

SMALL = {
    "reflector": {"object": "teapot", "subdivisions": 4, "parts": "split"},
    "views": {"count": 3, "degrees": 30.0, "size": [63, 48]},
    "maps": {"size": 16},
    "trace": {"samples": 2, "indirect": "none"},
    "auto": {"quality": "draft"},
}


@pytest.fixture(scope="module")
def pem(tmp_path_factory: pytest.TempPathFactory) -> OpenedPem:
    directory = tmp_path_factory.mktemp("video") / "pem"
    bake(parse_config(SMALL, "small"), directory)
    return open_pem(directory)


def test_a_film_shows_the_pictures_in_their_order(pem: OpenedPem, tmp_path: Path) -> None:
    out = tmp_path / "film.mp4"
    export_video(pem, out, frames_per_second=25, tone="neutral", exposure=0.5)
    with av.open(str(out)) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == 25
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert stream.codec_context.colorspace == 1
        decoded = [
            frame.reformat(format="rgb24", src_colorspace="ITU709").to_ndarray()
            for frame in container.decode(stream)
        ]
    assert len(decoded) == 3
    pictures = [
        srgb_bytes(displayed(render(pem.store.directory, t, tmp_path / "a.exr"), 0.5, "neutral"))
        for t in (0.0, 0.5, 1.0)
    ]
    luma = np.array([0.2126, 0.7152, 0.0722])
    for i, frame in enumerate(decoded):
        assert frame.shape == (48, 64, 3)  # an odd width is filled up
        shown = frame[:, :63].astype(float)
        errors = [np.mean(((shown - picture) @ luma) ** 2) for picture in pictures]
        # Chroma is halved, so that only luma has every pixel. The coder leaves 2 levels; two samples a pixel
        # are noise that differs by 10 and more from frame to frame.
        assert errors[i] < 4.0**2
        assert errors[i] < 0.5 * min(error for j, error in enumerate(errors) if j != i)
        # A wrong matrix or a wrong range would change the colours' means.
        assert np.abs((shown - pictures[i]).mean(axis=(0, 1))).max() < 1.5


def test_stills_are_what_render_draws(pem: OpenedPem, tmp_path: Path) -> None:
    paths = export_stills(pem, tmp_path / "still-{}.exr", frames=2)
    assert [path.name for path in paths] == ["still-0000.exr", "still-0001.exr"]
    for path, t in zip(paths, (0.0, 1.0), strict=True):
        render(pem.store.directory, t, tmp_path / "picture.exr")
        expected, _ = _core.load_image(str(tmp_path / "picture.exr"))
        written, _ = _core.load_image(str(path))
        np.testing.assert_array_equal(written, expected)


def test_a_walk_goes_along_the_first_axis_from_end_to_end() -> None:
    arc = Axis("arc", (0.0, 0.5, 1.0), 0.0, 1.0)
    assert walk(ParameterSpace((arc,)), None) == [(0.0,), (0.5,), (1.0,)]
    assert walk(ParameterSpace((arc,)), 5)[3] == (0.75,)
    around = Axis("azimuth", (0.0, 120.0, 240.0), 0.0, 360.0, 360.0)
    rings = Axis("elevation", (10.0, 20.0, 30.0), 10.0, 30.0)
    # Once round, without the first frame again.
    assert walk(ParameterSpace((around, rings)), 4) == [
        (0.0, 20.0),
        (90.0, 20.0),
        (180.0, 20.0),
        (270.0, 20.0),
    ]
    still = Axis("arc", (0.0,), 0.0, 0.0)
    with pytest.raises(OptionError, match="no axis to move along"):
        walk(ParameterSpace((still,)), None)
    with pytest.raises(OptionError, match="frames = 0: expected 1 to 100000"):
        walk(ParameterSpace((arc,)), 0)


def test_what_cannot_be_written_is_refused(pem: OpenedPem, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"film.avi: expected a name that ends in .mp4"):
        export_video(pem, tmp_path / "film.avi")
    with pytest.raises(OptionError, match="fps = 0: expected 1 to 240"):
        export_video(pem, tmp_path / "film.mp4", frames_per_second=0)
    with pytest.raises(InputError, match=r"expected a name with \{\} for the number"):
        export_stills(pem, tmp_path / "still.png")
    with pytest.raises(OptionError, match=r"an .exr holds scene-linear radiance"):
        export_stills(pem, tmp_path / "still{}.exr", tone="neutral")
    with pytest.raises(InputError, match="cannot write"):
        export_video(pem, tmp_path / "missing" / "film.mp4")
    assert not list(tmp_path.iterdir())
