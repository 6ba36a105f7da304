"""Whatever value of an example is edited: what is adopted renders so, and all else is named."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.adoption.adopt import Adoption, Reader, adopt
from swarmctl.adoption.changes import EditedFile, changes
from swarmctl.render.rendered_values import same_meaning, values_of
from tests import ROOT
from tests.adoption.adopting import Hosts, reader, rendered

SPECS = [ROOT / f"examples/{name}/swarm.yaml" for name in ("paper-2-leader", "paper-3-central", "lab-fleet")]


@cache
def hosts_of(spec: Path) -> tuple[Reader, Hosts]:
    read = reader(spec)
    return read, rendered(read)


@st.composite
def edits(draw: st.DrawFn) -> tuple[Path, EditedFile]:
    """A parameter file of an example in which one value is another one of its kind."""
    spec = draw(st.sampled_from(SPECS))
    _, hosts = hosts_of(spec)
    files = [
        (host, file)
        for host, bundle in hosts.items()
        for file in bundle.files
        if file.path.startswith("params/")
    ]
    host, file = draw(st.sampled_from(files))
    text = file.content.decode()
    keys = [key for key, one in (values_of(file.path, text) or {}).items() if _other(one) is not None]
    data: Any = yaml.safe_load(text)
    key = draw(st.sampled_from(keys))
    place = data
    for part in key[:-1]:
        place = place[part]
    place[key[-1]] = _other(place[key[-1]])
    return spec, EditedFile(host, file.path, file.path, yaml.safe_dump(data), file.digest)


def _other(value: Any) -> Any:
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return f"{value}x"
    return type(value)(value * 0.75) if isinstance(value, (int, float)) and value else None


@settings(max_examples=25, deadline=None, derandomize=True)
@given(edits())
def test_an_adopted_value_renders_as_it_was_edited(one: tuple[Path, EditedFile]) -> None:
    spec, file = one
    read, hosts = hosts_of(spec)
    assert_home(file, hosts, read, adopt(read, [file]))


def assert_home(file: EditedFile, hosts: Hosts, read: Reader, found: Adoption) -> None:
    before = next(one for one in hosts[file.host].files if one.path == file.path).content.decode()
    assert len(found.adopted) + len(found.refused) == len(changes(file, before))
    assert all(one.reason for one in found.refused)
    if found.adopted:
        after = next(
            one for one in rendered(read, found.texts)[file.host].files if one.path == file.path
        ).content.decode()
        assert same_meaning(file.path, after, file.text or "")
    else:
        assert found.texts == {}


def test_what_a_lab_tunes_can_be_adopted() -> None:
    read, hosts = hosts_of(SPECS[0])
    file = next(one for one in hosts["k3-pi"].files if one.path == "params/k3.yaml")
    data = yaml.safe_load(file.content)
    data["command_timeout"] = 0.4
    data["diagnostics_rate"] = 0.5
    data["kinematics"] |= {"linear_max": 0.1, "angular_max": 0.5}
    for sensor in data["sensors"].values():
        sensor["rate"] = 2.0
    edited = EditedFile("k3-pi", file.path, file.path, yaml.safe_dump(data), file.digest)
    found = adopt(read, [edited])
    assert not found.refused, found.refused
    assert len(found.adopted) == 4 + len(data["sensors"]) > 6
    assert_home(edited, hosts, read, found)
