"""Progress where nobody watches a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mirrorbake.commands import progress

if TYPE_CHECKING:
    import pytest


def test_a_log_gets_a_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = 0.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    with progress.progress() as add:
        report = add("bake")
        for step in range(60):
            now = float(step)
            report(step, 60, f"sample {step + 1}")
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"bake: {step} of 60, sample {step + 1}" for step in (10, 20, 30, 40, 50)]
