"""The report: one page with everything in it."""

from __future__ import annotations

import base64
import io
import re
from html.parser import HTMLParser
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

from mirrorbake.bake.bake import bake
from mirrorbake.errors import InputError
from mirrorbake.evaluate.contenders import TITLES
from mirrorbake.evaluate.evaluate import METRICS, Evaluation, ViewFigures
from mirrorbake.evaluate.metrics import display_referred
from mirrorbake.evaluate.report import report
from mirrorbake.evaluate.report.page import verdict
from mirrorbake.evaluate.report.pictures import Plot, picture_url
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path

SMALL = {
    "reflector": {"object": "teapot", "subdivisions": 6, "parts": "split"},
    "views": {"count": 2, "degrees": 1.0, "start": 22.0, "size": [64, 48]},
    "maps": {"size": 16},
    "trace": {"samples": 4, "depth": 2, "indirect": "none"},
    "auto": {"quality": "draft"},
}


class Page(HTMLParser):
    """Checks that tags are closed in turn, and collects what matters."""

    VOID = frozenset({"meta", "img", "input", "br", "link"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    directory = tmp_path_factory.mktemp("report") / "pem"
    bake(parse_config(SMALL, "small"), directory)
    path = report(directory, sections=[lambda folder: f"<h2>Seen {folder.name}</h2>"])
    assert path == directory / "report.html"
    return path, path.read_text(encoding="utf-8")


def test_the_page_is_well_formed_and_needs_no_other_file(written: tuple[Path, str]) -> None:
    page = Page(written[1])
    sources = [
        value or ""
        for _, attributes in page.attributes
        for name, value in attributes.items()
        if name in {"src", "href", "action", "poster", "srcset"}
    ]
    assert len(sources) > 20
    assert all(source.startswith("data:image/webp;base64,") for source in sources)
    assert "url(" not in written[1]
    assert "@import" not in written[1]
    assert ("meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"}) in page.attributes


def test_the_page_says_what_was_measured_decided_and_spent(written: tuple[Path, str]) -> None:
    words = " ".join(Page(written[1]).words)
    for name, title in TITLES.items():
        # A draft has no static set.
        assert (title in words) == (name != "static_set")
    for expected in (
        *("ceiling", "trace.depth", "set in the scene", "maps.size", "solving", "a view"),
        *("half-way between two", "10° above the arc", "numpy", "FLIP", "Seen pem"),
    ):
        assert expected in words


def test_pictures_have_words_for_those_who_do_not_see_them(written: tuple[Path, str]) -> None:
    images = [attributes for tag, attributes in Page(written[1]).attributes if tag == "img"]
    assert all(attributes.get("alt") for attributes in images)


def test_a_picture_is_exact_to_its_8_bits() -> None:
    radiance = np.random.default_rng(1).uniform(0, 1.2, (20, 30, 3)).astype(np.float32)
    data = base64.b64decode(picture_url(radiance).split(",", 1)[1])
    codes = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
    # Small pictures are enlarged by repeating their pixels.
    assert codes.shape == (16 * 20, 16 * 30, 3)
    expected = np.floor(display_referred(radiance) * 255 + 0.5).astype(np.uint8)
    np.testing.assert_array_equal(codes[::16, ::16], expected)


def test_a_report_that_cannot_be_written_is_refused_before_the_work(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot write"):
        report(tmp_path, tmp_path / "nowhere" / "report.html")


def made_up(pem: dict[str, float], static: float) -> Evaluation:
    views = []
    for place, value in pem.items():
        metrics: dict[str, Any] = {metric: {} for metric in METRICS}
        # Maps that were inferred for the page are worse when they are read in another way.
        metrics["psnr"] = {
            "pem": {"web": value, "reference": value - 9.0},
            "static_infinite": {"web": static, "reference": static + 1.0},
        }
        views.append(ViewFigures(place, 0.0, (0.0,), 40.0, 16, 1.0, metrics))
    return Evaluation(views, {})


def test_the_verdict_says_where_a_static_map_does_as_well() -> None:
    good = verdict(made_up({"on": 30.0, "between": 29.0, "off_15": 25.0}, 20.0), "web")
    assert "30.0 dB on its samples and 29.0 dB between" in good
    assert "Run time: web" in good
    assert "better" not in good
    assert "15° past the end of the arc" in verdict(made_up({"on": 30.0, "off_15": 18.0}, 20.0), "web")
    assert "no lead worth" in verdict(made_up({"on": 20.5}, 20.0), "web")
    assert "nothing to measure" in verdict(Evaluation([], {}), "web")


def test_a_plot_has_its_points_where_they_belong() -> None:
    plot = Plot([0.0, 10.0], [12.0, 28.0], ("degrees", "dB"), title="curve & more")
    plot.curve([(0.0, 10.0), (10.0, 30.0)], "")
    svg = plot.svg()
    Page(svg)
    assert "curve &amp; more" in svg
    found = re.search(r'points="([\d.]+),([\d.]+) ([\d.]+),([\d.]+)"', svg)
    assert found
    left, bottom, right, top = (float(value) for value in found.groups())
    # From the lower left corner of the axes to the upper right one: 10 to 30 are the round values around.
    assert (left, bottom, right, top) == (46.0, 280.0, 746.0, 12.0)
