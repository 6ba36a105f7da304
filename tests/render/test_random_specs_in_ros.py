"""The files of random valid specs, read by the ROS that reads them on a host."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from lxml import etree

from swarmctl.lab.hosts import image
from tests.render.reader_of import Reader, reader_of
from tests.render.test_random_specs import AT_ONCE, SPECS, Written, rendered

pytestmark = pytest.mark.lab
XSD = "opt/ros/jazzy/share/fastRTPS_profiles.xsd"
#: That of the manual, and that of the schema.
NAMESPACES = (b'"http://www.eprosima.com"', b'"http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"')
#: The manual has an empty locator for the usual ones; the schema has none.
EMPTY = (b"<locator/>", b"<locator><udpv4/></locator>")
INCLUDE = re.compile(r"\$\(find ([^)]+)\)/(.+)")


@pytest.fixture(scope="module")
def rosparam() -> Iterator[Reader]:
    yield from reader_of("")


@pytest.fixture(scope="module")
def rcl() -> Iterator[Reader]:
    yield from reader_of("jazzy")


@pytest.mark.parametrize("first", range(0, max(AT_ONCE, SPECS // 5), AT_ONCE))
def test_ros_reads_all(first: int, rosparam: Reader, rcl: Reader, tmp_path: Path) -> None:
    files = list(rendered(range(first, first + AT_ONCE), tmp_path))
    assert refused_by_roslaunch(files, rosparam) == {}
    assert refused_by_rcl(files, rcl) == {}
    assert refused_by_fast_dds(files) == {}
    assert refused_by_chrony(files) == {}


def refused_by_roslaunch(files: list[Written], reader: Reader) -> dict[str, str]:
    """The errors of roslaunch in the launch files, with stand-ins of the files that they include."""
    given: dict[str, str] = {}
    included: dict[tuple[str, str], set[str]] = {}  # by package and path: the arguments
    for one in files:
        if one.path.startswith(("launch/", "params/", "bin/", "urdf/")) and not one.path.endswith(".xml"):
            text = one.content.decode().replace(f"/swarm{one.seed}/", f"/swarm{one.seed}{one.host}/")
            given[f"/opt/swarm/swarm{one.seed}{one.host}/current/{one.path}"] = text
        for include in etree.fromstring(one.content).iter("include") if one.path.endswith(".launch") else ():
            if found := INCLUDE.fullmatch(include.get("file", "")):
                arguments = included.setdefault((found[1], found[2]), set())
                arguments.update(arg.get("name", "") for arg in include.iter("arg"))
    for (package, path), names in included.items():
        given[f"/packages/{package}/package.xml"] = f"<package><name>{package}</name></package>"
        declared = "".join(f'<arg name="{name}" default="" />' for name in names)
        given[f"/packages/{package}/{path}"] = f"<launch>{declared}</launch>"
    refused = dict(reader.read(given))
    return {path: message for path, message in refused.items() if not path.startswith("/packages/")}


def refused_by_rcl(files: list[Written], reader: Reader) -> dict[str, str]:
    answers = {
        one.name: reader.read(one.content.decode())
        for one in files
        if one.path.endswith(".yaml") and b"ros__parameters:" in one.content
    }
    return {name: answer["error"] for name, answer in answers.items() if "error" in answer}


def refused_by_fast_dds(files: list[Written]) -> dict[str, str]:
    """The errors of its schema in the profiles."""
    disk = image.ensure(lambda _line: None, distro="jazzy")
    schema = etree.XMLSchema(etree.parse(disk / XSD))
    documents = {
        one.name: etree.fromstring(one.content.replace(*NAMESPACES).replace(*EMPTY))
        for one in files
        if one.path == "env/fastdds.xml"
    }
    return {name: str(schema.error_log) for name, one in documents.items() if not schema.validate(one)}


def refused_by_chrony(files: list[Written]) -> dict[str, str]:
    disk = image.ensure(lambda _line: None, distro="jazzy")
    found = {}
    for one in files:
        if one.path == "chrony/block":
            argv = ["chroot", str(disk), "chronyd", "-p", *one.content.decode().splitlines()]
            done = subprocess.run(argv, capture_output=True, text=True, check=False)
            if done.returncode:
                found[one.name] = done.stderr
    return found
