"""Prints the requirements of the extra `bench` that are not installed, one a line."""

from importlib.metadata import PackageNotFoundError, requires, version

from packaging.requirements import Requirement

for text in requires("mirrorbake") or ():
    requirement = Requirement(text)
    if requirement.marker is None or not requirement.marker.evaluate({"extra": "bench"}):
        continue
    if requirement.marker.evaluate({"extra": ""}):
        continue
    try:
        satisfied = requirement.specifier.contains(version(requirement.name), prereleases=True)
    except PackageNotFoundError:
        satisfied = False
    if not satisfied:
        print(f"{requirement.name}{requirement.specifier}")
