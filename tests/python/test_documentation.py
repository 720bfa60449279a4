"""The examples of the documentation run, and the commands it names exist."""

import re
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

import mirrorbake
from mirrorbake.bake.bake import bake
from mirrorbake.commands.main import app
from mirrorbake.scene.load import parse_config

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PYTHON = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
SHELL = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)

SMALL_TEAPOT = {
    "reflector": {"object": "teapot", "subdivisions": 4},
    "views": {"count": 1, "size": [48, 48]},
    "maps": {"size": 16},
    "trace": {"samples": 2, "indirect": "none"},
}


def blocks(pattern: re.Pattern[str]) -> dict[str, list[str]]:
    pages = {str(page.relative_to(ROOT)): pattern.findall(page.read_text(encoding="utf-8")) for page in PAGES}
    return {page: found for page, found in pages.items() if found}


@pytest.mark.parametrize("page", blocks(PYTHON))
def test_python_examples_of_a_page_run_from_top_to_bottom(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    # The examples' own files.
    mirrorbake.save_image("panorama.exr", np.full((128, 256, 3), 0.5, np.float32))
    if any("out/teapot" in block for block in blocks(PYTHON)[page]):
        bake(parse_config(SMALL_TEAPOT, "small teapot"), tmp_path / "out" / "teapot")
    namespace: dict[str, object] = {}
    for block in blocks(PYTHON)[page]:
        exec(compile(block, page, "exec"), namespace)


def test_commands_in_the_documentation_exist() -> None:
    commands = set(getattr(get_command(app), "commands", {}))
    assert {"bake", "evaluate", "render", "demo"} <= commands
    named = {
        (page, line)
        for page, found in blocks(SHELL).items()
        for line in "".join(found).splitlines()
        if line.startswith(("mirrorbake ", "script/"))
    }
    assert named
    for page, line in sorted(named):
        program, *rest = line.split()
        if program == "mirrorbake":
            assert rest[0] in commands or rest[0].startswith("--"), f"{page}: {line}"
        else:
            assert (ROOT / program).is_file(), f"{page}: {line}"
