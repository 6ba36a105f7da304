"""What SROS 2 adds to a release, and what restarts when a robot joins, a key or a permission changes."""

from __future__ import annotations

import difflib
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from swarmctl.render.bundle import Bundle, File
from swarmctl.spec import keystore
from tests.render.test_ros2 import GOLDEN, made
from tests.sros2 import JOINS, bundles_in, write_fake_keystore, write_spec

ROS = "distro: jazzy, domain: 42, discovery: peers"
PEOPLE = "swarm-newswarm.enclaves.service"


def difference(old: File, new: File) -> str:
    """The lines that change, without their neighbours."""
    texts = (file.content.decode().splitlines(keepends=True) for file in (old, new))
    return "".join(difflib.unified_diff(*texts, new.path, new.path, n=0))


def test_golden(tmp_path: Path, golden: Callable[[Path, str], None], regenerating: bool) -> None:
    """Files that are new, and the differences of the others. What is signed has tests of its own."""
    root, expected = GOLDEN / "sros2", set()
    if regenerating:
        shutil.rmtree(root, ignore_errors=True)
    plain = made(tmp_path, "central", ROS, "leader")
    made(tmp_path, "central", f"{ROS}, sros2: true", "leader")
    write_fake_keystore(tmp_path)
    for host, bundle in bundles_in(tmp_path).items():
        before, changes = {file.path: file for file in plain[host].files}, ""
        for file in bundle.files:
            if file.path in before:
                changes += difference(before.pop(file.path), file)
            elif not file.path.startswith("enclaves/"):
                golden(root / host / file.path, file.content.decode())
                expected.add(f"{host}/{file.path}")
        assert before == {}
        golden(root / host / "CHANGES.diff", changes)
        golden(root / host / "UNITS", added_to_units(plain[host], bundle))
        expected |= {f"{host}/CHANGES.diff", f"{host}/UNITS"}
    assert {str(one.relative_to(root)) for one in root.rglob("*") if one.is_file()} == expected


def added_to_units(plain: Bundle, bundle: Bundle) -> str:
    """What each unit needs beside what it needs without SROS 2, and its secrets."""
    needs = {unit.name: unit.needs for unit in plain.units}
    return "".join(
        f"{unit.name}: {' '.join(path for path in unit.needs if path not in needs.get(unit.name, ()))}; "
        f"secrets: {' '.join(unit.secrets)}\n"
        for unit in bundle.units
    )


def digests(folder: Path) -> Mapping[str, Mapping[str, str]]:
    """The digests of what each unit needs, by host and unit, with a keystore as `keys` completes it."""
    write_fake_keystore(folder)
    return {
        host: {unit["name"]: unit["digest"] for unit in bundle.manifest["units"]}
        for host, bundle in bundles_in(folder).items()
    }


def restarted(
    before: Mapping[str, Mapping[str, str]], after: Mapping[str, Mapping[str, str]]
) -> dict[str, set[str]]:
    """The units that restart, by host."""
    return {
        host: {name for name, digest in units.items() if after[host].get(name, digest) != digest}
        for host, units in before.items()
    }


def test_no_robot_stops_when_another_one_joins(tmp_path: Path) -> None:
    """But the joystick restarts, which gets another robot, and so do people's keys, for later programs."""
    write_spec(tmp_path)
    before = digests(tmp_path)
    write_spec(tmp_path, JOINS)
    assert restarted(before, digests(tmp_path)) == {
        "koala-laptop": {PEOPLE, "swarm-newswarm.joystick.service"},
        "k3-pi": {PEOPLE},
        "epuck-pi": {PEOPLE},
    }


def test_a_program_of_people_gets_its_new_permissions(tmp_path: Path) -> None:
    def commanding(robots: str) -> Mapping[str, Mapping[str, str]]:
        program = "  keys: {host: koala-laptop, use: teleop-key}\n"
        control = f"  - {{by: keys, of: [{robots}], priority: 1}}\n"
        write_spec(
            tmp_path, {"  joystick: {": f"{program}  joystick: {{", "  - {by: joy": f"{control}  - {{by: joy"}
        )
        return digests(tmp_path)

    assert restarted(commanding("k3"), commanding("k3, epuck")) == {
        "koala-laptop": {PEOPLE},
        "k3-pi": set(),
        "epuck-pi": {"swarm-newswarm.epuck.service"},
    }


#: What is another one, by file; and what restarts for it on the host of k3.
ANOTHER = {
    keystore.CA: {PEOPLE, "swarm-newswarm.k3.service"},
    f"{keystore.folder('newswarm', 'robots/k3')}/{keystore.CERTIFICATE}": {"swarm-newswarm.k3.service"},
    f"{keystore.folder('newswarm', 'hosts/k3-pi')}/{keystore.CERTIFICATE}": {PEOPLE},
    f"{keystore.folder('newswarm', 'robots/epuck')}/{keystore.CERTIFICATE}": set[str](),
    f"{keystore.folder('newswarm', 'robots/k3')}/{keystore.PERMISSIONS}": set[str](),
    f"{keystore.folder('newswarm', 'hosts/k3-pi')}/{keystore.PERMISSIONS}": {PEOPLE},
}


@pytest.mark.parametrize("path", ANOTHER)
def test_a_file_of_an_enclave_restarts_what_runs_in_it(path: str, tmp_path: Path) -> None:
    write_spec(tmp_path)
    before = digests(tmp_path)
    (tmp_path / path).write_bytes(b"another\n" + (tmp_path / path).read_bytes())
    after = {
        host: {unit["name"]: unit["digest"] for unit in bundle.manifest["units"]}
        for host, bundle in bundles_in(tmp_path).items()
    }
    assert restarted(before, after)["k3-pi"] == ANOTHER[path]
