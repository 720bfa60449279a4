"""The comparison of vertices and maps for diffuse light."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from mirrorbake.errors import InputError
from mirrorbake.scene.load import parse_config
from mirrorbake.study import diffuse

if TYPE_CHECKING:
    from pathlib import Path

TEAPOT = {
    "reflector": {"object": "teapot", "subdivisions": 3},
    "material": {"ior": [1.5] * 3, "fresnel": "dielectric", "albedo": [0.7, 0.6, 0.5], "layers": "coated"},
    "views": {"count": 1, "size": [40, 30]},
    "trace": {"indirect": "none"},
}


def test_what_is_stored_grows_and_errs_less(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diffuse, "SIZES", (4, 32))
    monkeypatch.setattr(diffuse, "HALVINGS", 1)
    ways = list(diffuse.ways_to_store(parse_config(TEAPOT, "teapot")))
    vertices, finer, coarse, fine = ways
    assert vertices.name == "vertices as they are"
    assert [way.name for way in (coarse, fine)] == ["map of 4²", "map of 32²"]
    assert vertices.values < finer.values
    assert coarse.values == 2 * 16 < fine.values <= 2 * 32 * 32
    assert coarse.change > fine.change
    assert coarse.change > finer.change


def test_a_black_body_is_refused() -> None:
    black = {**TEAPOT, "material": {"metal": "silver"}}
    with pytest.raises(InputError, match=r"material\.albedo: black"):
        next(iter(diffuse.ways_to_store(parse_config(black, "teapot"))))


def test_the_command_refuses_objects_of_a_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text('[reflector]\nscene_object = "ball"\n[surroundings]\nscene = "scene.glb"\n')
    with pytest.raises(InputError, match="keeps its mesh"):
        diffuse.main([str(scene)])
    assert "| scene |" in capsys.readouterr().out
