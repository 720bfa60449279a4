"""Where an object's surroundings are captured when something else stands in its middle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.analyze import analyze
from mirrorbake.bake.capture_place import capture_place
from mirrorbake.errors import InputError
from mirrorbake.pem.pyramid import capture
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake.scene.stage import Stage

RING = _core.make_torus((0, 0.5, 0), 1.0, 0.2, 16)
POLE = _core.make_box((-0.4, 0.0, -0.4), (0.4, 3.0, 0.4))


def stage_with(folder: Path, **others: _core.TriangleMesh) -> Stage:
    """Prepare a shiny ring among matte things under a sky of radiance 1."""
    lines, first = ["mtllib m.mtl"], 1
    for name, mesh in {"ring": RING, **others}.items():
        lines += [f"o {name}", f"usemtl {'shiny' if name == 'ring' else 'matte'}"]
        lines += [f"v {x} {y} {z}" for x, y, z in mesh.positions.tolist()]
        lines += ["f " + " ".join(str(i + first) for i in t) for t in mesh.triangles.tolist()]
        first += len(mesh.positions)
    (folder / "scene.obj").write_text("\n".join(lines) + "\n")
    materials = "newmtl shiny\nKd 0 0 0\nKs 0.9 0.9 0.9\nillum 3\nnewmtl matte\nKd 0.5 0.5 0.5\n"
    (folder / "m.mtl").write_text(materials)
    _core.save_image(str(folder / "sky.exr"), np.ones((8, 16, 3), np.float32), ["R", "G", "B"])
    sections = {
        "reflector": {"scene_object": "ring"},
        "surroundings": {"scene": str(folder / "scene.obj"), "panorama": str(folder / "sky.exr")},
        "views": {"count": 2, "size": [32, 32]},
        "trace": {"indirect": "none", "samples": 4},
    }
    return prepare_stage(parse_config(sections, "scene"))


def test_a_ring_around_a_pole_is_captured_from_beside_the_pole(tmp_path: Path) -> None:
    stage = stage_with(tmp_path, pole=POLE)
    place = capture_place(stage)
    assert place.inside == "pole"
    assert not _core.encloses(stage.built.scene.object_mesh(1), place.position)
    assert np.all(np.abs(place.position) <= np.abs(stage.built.positions).max(axis=0))
    plan = analyze(stage)
    assert plan.distant["origin"] == pytest.approx(place.position)
    assert any("beside 'pole'" in line for line in plan.lines())
    # The inside of the pole is black; from beside it, it hides a part of the sky at most.
    seen = [
        capture(stage.tracer, origin, "cube", 8, [0], _core.TraceOptions())
        for origin in ((0.0, 0.5, 0.0), place.position)
    ]
    assert float(seen[0].max()) == 0.0
    assert float(np.median(seen[1])) == 1.0


def test_without_something_in_its_middle_an_object_is_captured_from_there(tmp_path: Path) -> None:
    beside = _core.make_box((2.0, 0.0, -0.4), (2.5, 3.0, 0.4))
    place = capture_place(stage_with(tmp_path, pole=beside))
    assert place.inside is None
    assert place.position == pytest.approx((0.0, 0.5, 0.0), abs=1e-5)


def test_a_room_around_the_object_is_not_in_its_way(tmp_path: Path) -> None:
    # A box whose sides face outwards, as people model skies.
    room = _core.make_box((-9.0, -1.0, -9.0), (9.0, 9.0, 9.0))
    place = capture_place(stage_with(tmp_path, room=room))
    assert place.inside is None


def test_an_object_that_others_fill_is_refused_by_name(tmp_path: Path) -> None:
    left = _core.make_box((-3.0, -1.0, -3.0), (0.3, 3.0, 3.0))
    right = _core.make_box((-0.3, -1.0, -3.0), (3.0, 3.0, 3.0))
    with pytest.raises(InputError, match=r"lies inside the object 'left'.*no place"):
        capture_place(stage_with(tmp_path, left=left, right=right))
