"""Migrations of a made-up format, text to text."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.migration.migrate import Migrated, UnreadableError, migrated
from swarmctl.migration.steps import places
from swarmctl.migration.versions import SPEC_VERSIONS
from swarmctl.spec.model import Spec
from swarmctl.yamltext.files import content
from tests.migration.made_up import FORMATS

OLD = """\
# our lab
version: 0   # keep
leader: laptop

hosts:
  laptop: {ip: lab@10.0.0.1}    # on the desk
  'k3-pi':
    # behind the door
    ip: "robot@10.0.0.2"
    port: 2222   # forwarded
robots:
  k3: {wheelbase: 9}
"""
ONE = """\
# our lab
version: 1   # keep
leader: laptop

hosts:
  laptop: {address: lab@10.0.0.1}    # on the desk
  'k3-pi':
    # behind the door
    address: "robot@10.0.0.2"
    port: 2222   # forwarded
robots:
  k3: {wheelbase: 0.09}
"""
TWO = """\
# our lab
version: 2   # keep

hosts:
  laptop: {address: 10.0.0.1, user: lab}    # on the desk
  'k3-pi':
    # behind the door
    address: "10.0.0.2"
    user: robot
    ssh: {port: 2222}
robots:
  k3: {wheelbase: 0.09}

roles:
  leader: laptop
"""


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return Path("swarm.yaml")


def result(*layers: Path, to: int = 2) -> Migrated:
    return migrated(layers, content, to, FORMATS)


def new_text(spec: Path, text: str, to: int = 2) -> str:
    spec.write_text(text, "utf-8")
    found = result(spec, to=to)
    assert not found.undone
    return found.texts.get(str(spec), text)


def test_each_version_leads_to_the_next(spec: Path) -> None:
    assert new_text(spec, OLD, to=1) == ONE
    assert new_text(spec, ONE) == TWO


def test_a_chain_is_the_same_as_its_steps(spec: Path) -> None:
    assert new_text(spec, OLD) == TWO


def test_a_migrated_spec_stays_as_it_is(spec: Path) -> None:
    spec.write_text(TWO, "utf-8")
    assert result(spec) == Migrated(2, {})


def test_each_change_is_named_with_its_line(spec: Path) -> None:
    spec.write_text(OLD, "utf-8")
    notes = result(spec).notes
    assert "swarm.yaml:6:12: `hosts.laptop.ip` is now `address`" in notes
    assert "swarm.yaml:12:8: `robots.k3.wheelbase` is now 0.09" in notes
    assert "swarm.yaml:10:5: `hosts.k3-pi.port` is now in `hosts.k3-pi.ssh`" in notes
    assert "swarm.yaml:10: the comment of a removed key is gone: # forwarded" in notes


def test_what_cannot_be_migrated_has_its_place_and_changes_nothing(spec: Path) -> None:
    spec.write_text(OLD.replace("9}", "wide}").replace("{ip: lab", "{address: x, ip: lab"), "utf-8")
    found = result(spec)
    assert found.texts == {}
    assert [f"{span}: {why}" for span, why in found.undone] == [
        "swarm.yaml:6:24: `hosts.laptop.ip` is now `address`: `address` is there as well",
        "swarm.yaml:12:8: `robots.k3.wheelbase` cannot be rewritten: `wide` is no number of centimetres",
    ]


def test_a_new_place_that_is_taken_is_not_overwritten(spec: Path) -> None:
    spec.write_text("version: 1\nleader: a\nroles: {leader: b}\n", "utf-8")
    found = result(spec)
    assert found.texts == {}
    assert [why for _, why in found.undone] == ["`leader` cannot move: `roles.leader` has another value"]


def test_includes_and_overlays_are_migrated_too(spec: Path) -> None:
    spec.write_text("version: 0\ninclude: hosts.yaml\nrobots:\n  k3: {wheelbase: 9}\n", "utf-8")
    Path("hosts.yaml").write_text("hosts:\n  pi: {ip: a@10.0.0.1}  # door\n", "utf-8")
    Path("field.yaml").write_text("hosts:\n  pi: {ip: a@10.9.9.9}\n", "utf-8")
    assert result(spec, Path("field.yaml")).texts == {
        "swarm.yaml": "version: 2\ninclude: hosts.yaml\nrobots:\n  k3: {wheelbase: 0.09}\n",
        "hosts.yaml": "hosts:\n  pi: {address: 10.0.0.1, user: a}  # door\n",
        "field.yaml": "hosts:\n  pi: {address: 10.9.9.9, user: a}\n",
    }


def test_a_range_changes_as_one(spec: Path) -> None:
    text = "version: 0\nrobots:\n  k[1-3]: {wheelbase: 9}  # all alike\n"
    text += "hosts:\n  pi-[1-3]: {ip: 'a@10.0.0.[1-3]'}\n"
    assert new_text(spec, text, to=1) == text.replace("version: 0", "version: 1").replace(
        "wheelbase: 9", "wheelbase: 0.09"
    ).replace("ip:", "address:")


def test_a_range_with_several_new_values_is_left_to_a_person(spec: Path) -> None:
    spec.write_text("version: 1\nhosts:\n  pi-[1-2]: {address: 'a@10.0.0.[1-2]'}\n", "utf-8")
    found = result(spec)
    assert found.texts == {}
    assert {str(span) for span, _ in found.undone} == {"swarm.yaml:3:14"}
    assert all("a range whose elements do not change alike" in why for _, why in found.undone)


def test_values_of_two_places_never_become_one(spec: Path) -> None:
    spec.write_text("version: 1\nleader: &name laptop\nhosts: {a: {address: *name}}\n", "utf-8")
    found = result(spec)
    assert found.texts == {}
    assert found.undone


def test_line_ends_of_windows_stay(spec: Path) -> None:
    spec.write_bytes(OLD.replace("\n", "\r\n").encode())
    assert result(spec, to=1).texts[str(spec)] == ONE.replace("\n", "\r\n")


def test_a_spec_with_wrong_yaml_is_not_touched(spec: Path) -> None:
    spec.write_text("version: 0\nhosts: {a: [\n", "utf-8")
    with pytest.raises(UnreadableError):
        result(spec)


def test_a_pattern_meets_items_of_lists() -> None:
    data = {"links": ({"port": 1}, {"host": "a"}, {"port": 2})}
    assert list(places(data, ("links", "*", "port"))) == [
        (("links", 0, "port"), 1),
        (("links", 2, "port"), 2),
    ]


def test_the_models_are_those_of_the_current_version() -> None:
    assert Spec.model_json_schema()["properties"]["version"]["const"] == SPEC_VERSIONS.current
    assert set(SPEC_VERSIONS.steps_from) == set(range(1, SPEC_VERSIONS.current))
