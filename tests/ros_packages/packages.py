"""Packages for tests, from the text of their files."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.ros_packages.launch_files import Launched, evaluate
from swarmctl.ros_packages.package import Package, package_of


def manifest(name: str, *depends: str) -> str:
    """The package.xml of a package."""
    listed = "".join(f"<exec_depend>{one}</exec_depend>" for one in depends)
    return (
        f'<package format="2"><name>{name}</name><version>1.0.0</version><description>d</description>'
        f'<maintainer email="a@b.example">a</maintainer><license>MIT</license>{listed}</package>'
    )


def package(name: str, files: Mapping[str, str], *depends: str, executable: tuple[str, ...] = ()) -> Package:
    """A package with these files; those in ``executable`` may be executed."""
    texts = {"package.xml": manifest(name, *depends), **files}
    contents = {path: text.encode() for path, text in texts.items()}
    found = package_of(f"src/{name}", {path: path in executable for path in texts}, contents)
    assert found is not None
    return found


def launched(text: str, *others: Package, limit: int = 10_000, ns: str = "/", **given: str) -> Launched:
    """What a launch file with ``text`` in package `own` brings, included with the arguments ``given``."""
    own = package("own", {"launch/main.launch": text})
    packages = {one.name: one for one in (own, *others)}
    return evaluate(own, "launch/main.launch", given, ns, packages, limit=limit)
