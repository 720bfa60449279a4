"""The page on accuracy: every row holds, and the page has every row."""

from pathlib import Path

import pytest

from mirrorbake.study.accuracy import accuracy
from mirrorbake.study.accuracy_row import Accuracy

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "accuracy.md").read_text(encoding="utf-8")
ROWS = accuracy(cosines=24, rays=3)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.function} {row.domain}")
def test_the_error_is_within_what_the_page_allows(row: Accuracy) -> None:
    assert row.error <= row.bound
    assert f"| {row.function} | {row.domain} | {row.against} |" in PAGE
    line = next(line for line in PAGE.splitlines() if line.startswith(f"| {row.function} | {row.domain} |"))
    assert line.endswith(f"| {row.bound:.2g} |")
