"""What surrounds the commands: a folder that is read-only, completion by the shell, the library by itself."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MIRRORBAKE = Path(sys.executable).with_name("mirrorbake")

SCENE = """
[reflector]
object = "teapot"
subdivisions = 2
parts = "joined"
[views]
count = 1
size = [32, 24]
[maps]
size = 8
[trace]
samples = 1
indirect = "none"
[auto]
quality = "draft"
"""


def run(
    *arguments: str | Path, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(argument) for argument in arguments],
        env={**os.environ, **(environment or {})},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def without_privileges() -> list[str]:
    """What a command begins with so that permissions hold for it: root may write anywhere else."""
    if os.geteuid() != 0:
        return []
    if shutil.which("setpriv") is None:
        pytest.skip("setpriv, which takes root's privileges away, is not installed")
    capabilities = "-dac_override,-dac_read_search,-fowner"
    return ["setpriv", f"--bounding-set={capabilities}", f"--inh-caps={capabilities}"]


def test_evaluate_in_a_read_only_folder_prints_its_table_and_succeeds(tmp_path: Path) -> None:
    scene, pem = tmp_path / "scene.toml", tmp_path / "pem"
    scene.write_text(SCENE)
    baked = run(MIRRORBAKE, "bake", scene, "--out", pem)
    assert baked.returncode == 0, baked.stderr
    folders = [pem, *(path for path in pem.rglob("*") if path.is_dir())]
    files_before = sorted(pem.rglob("*"))
    for folder in folders:
        folder.chmod(0o555)
    try:
        prefix = without_privileges()
        assert run(*prefix, "touch", pem / "file").returncode != 0
        result = run(*prefix, MIRRORBAKE, "evaluate", pem)
    finally:
        for folder in folders:
            folder.chmod(0o755)
    assert result.returncode == 0, result.stderr
    assert "PSNR" in result.stdout
    assert "Traceback" not in result.stderr
    assert "wrote" not in result.stderr
    assert f"{pem / 'metrics.json'}: cannot write: Permission denied" in result.stderr
    assert result.stderr.count(f"{pem / 'metrics.json'}") == 1
    assert sorted(pem.rglob("*")) == files_before


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_show_completion_prints_a_script_and_completion_knows_the_commands(shell: str) -> None:
    # Typer asks the process above for its shell's name unless this is set.
    shown = run(
        MIRRORBAKE,
        "--show-completion",
        shell,
        environment={"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
    )
    assert shown.returncode == 0, shown.stderr
    assert "_MIRRORBAKE_COMPLETE" in shown.stdout
    asked = {
        "bash": {"COMP_WORDS": "mirrorbake ba", "COMP_CWORD": "1"},
        "zsh": {"_TYPER_COMPLETE_ARGS": "mirrorbake ba"},
        "fish": {"_TYPER_COMPLETE_ARGS": "mirrorbake ba", "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
    }[shell]
    completed = run(MIRRORBAKE, environment={"_MIRRORBAKE_COMPLETE": f"complete_{shell}", **asked})
    assert "bake" in completed.stdout


def test_install_completion_writes_into_the_home_folder_alone(tmp_path: Path) -> None:
    result = run(
        MIRRORBAKE,
        "--install-completion",
        "bash",
        environment={"HOME": str(tmp_path), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
    )
    assert result.returncode == 0, result.stderr
    assert "completion installed" in result.stdout
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert any("_MIRRORBAKE_COMPLETE" in path.read_text() for path in written)
    assert any(path.name == ".bashrc" for path in written)


def test_the_preset_of_the_library_has_no_programs_tests_or_python(tmp_path: Path) -> None:
    if shutil.which("cmake") is None or shutil.which("ninja") is None:
        pytest.skip("CMake and Ninja are not installed")
    configured = run("cmake", "--preset", "library", "-S", ROOT, "-B", tmp_path)
    assert configured.returncode == 0, configured.stderr
    listed = run("ninja", "-C", tmp_path, "-t", "targets", "all")
    targets = re.findall(r"^(\S+): ", listed.stdout, re.MULTILINE)
    libraries = {Path(target).name for target in targets if target.endswith(".a")}
    assert {"libmirrorbake_scene.a", "libmirrorbake_tracer.a", "libmirrorbake_inference.a"} <= libraries
    names = {Path(target).name for target in targets}
    assert not {name for name in names if re.match(r"mb-|test_|_core|fuzz_|bench_", name)}
