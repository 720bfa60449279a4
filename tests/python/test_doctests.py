"""The examples in docstrings give what they show."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import pytest

import mirrorbake

MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(mirrorbake.__path__, "mirrorbake.")
    if not module.name.rsplit(".", 1)[-1].startswith(("__main__", "lib"))
)


def examples_of(name: str) -> list[doctest.DocTest]:
    module = importlib.import_module(name)
    return [test for test in doctest.DocTestFinder().find(module, name) if test.examples]


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_a_module_hold(name: str) -> None:
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    for test in examples_of(name):
        runner.run(test)
    assert runner.summarize(verbose=False).failed == 0


def test_there_are_examples() -> None:
    assert sum(len(test.examples) for name in MODULES for test in examples_of(name)) >= 30
