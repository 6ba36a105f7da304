"""A host, a robot, a program or a group gets another name in every file of a spec, and means the same."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from swarmctl.linter.runner import check_files
from swarmctl.spec.load import Document
from swarmctl.swarm.renaming import KINDS, RenameError, Renaming, rename
from swarmctl.yamltext.files import content
from tests import ROOT

BASE = """\
version: 1
name: lab
mode: combined
hosts:
  desk: {address: 10.0.0.2, has: [look]}           # the one at the door
  pi: {address: 10.0.0.3, via: desk}
  pi-[1-2]: {address: "10.0.0.[11-12]"}
robots:
  k3: {type: khepera3, host: "${main}", settings: {limits: {linear: "${speed}"}}}
  k4-[1-2]: {type: khepera3, host: "pi-[1-2]"}
groups:
  some: ["k4-*&!k3"]
  more: ["@some", "host:desk", "!robot:k3", "program:camera-k3"]
vars: {main: pi, speed: {default: 0.1, k3: 0.2, "@some": 0.1}}
islands:
  west: {mode: central, hosts: [desk, "pi"], hub: desk}
  east: {mode: leader, hosts: ["pi-[1-2]"], leader: pi-1}
links:
  - {kind: wlan, name: air, hosts: ["*"]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: F1}}
  - {kind: serial, host: "pi-[1-2]", robot: "k4-[1-2]", usb: {serial: "F2[1-2]"}}
programs:
  camera: {robots: ["@some", k3], package: usb_cam, executable: usb_cam_node, optional: true}
  look:
    host: desk
    package: image_view
    executable: image_view
    remap: {image: /k3/camera/image}
    subscribes: [{topic: /k3/odom, type: nav_msgs/Odometry}]
    params: {frame: k3/base_link}     # k3 stays here
control:
  - {by: camera-k3, of: [k3]}
  - {by: look, of: ["@some,!k3"]}
experiments:
  circles:
    robots: [k3]
    programs: [look]
    duration: 10
    record: ["/k3/*", k3/odom]
    until: [{topic: k3/odom, distance: 1}]
multimaster: {topics: [{topic: /k3/odom, to: [east]}]}
time: {root: desk}
ignore:
  - {rule: SET001, about: desk, reason: measured}
"""
OVERLAY = """\
hosts: {desk: {address: 10.0.0.99}}
robots: {k3: {optional: true}}
control:
  - {by: camera-k3, priority: 3}
"""

#: By kind and old name: the lines of the spec that change, with the new name `new-1`.
CHANGED = {
    ("host", "desk"): [
        "  new-1: {address: 10.0.0.2, has: [look]}           # the one at the door",
        "  pi: {address: 10.0.0.3, via: new-1}",
        '  more: ["@some", "host:new-1", "!robot:k3", "program:camera-k3"]',
        '  west: {mode: central, hosts: [new-1, "pi"], hub: new-1}',
        "    host: new-1",
        "time: {root: new-1}",
        "  - {rule: SET001, about: new-1, reason: measured}",
        "hosts: {new-1: {address: 10.0.0.99}}",
    ],
    ("host", "pi"): [
        "  new-1: {address: 10.0.0.3, via: desk}",
        'vars: {main: new-1, speed: {default: 0.1, k3: 0.2, "@some": 0.1}}',
        '  west: {mode: central, hosts: [desk, "new-1"], hub: desk}',
        "  - {kind: serial, host: new-1, robot: k3, usb: {serial: F1}}",
    ],
    ("robot", "k3"): [
        '  new-1: {type: khepera3, host: "${main}", settings: {limits: {linear: "${speed}"}}}',
        '  some: ["k4-*&!new-1"]',
        '  more: ["@some", "host:desk", "!robot:new-1", "program:camera-new-1"]',
        'vars: {main: pi, speed: {default: 0.1, new-1: 0.2, "@some": 0.1}}',
        "  - {kind: serial, host: pi, robot: new-1, usb: {serial: F1}}",
        '  camera: {robots: ["@some", new-1], package: usb_cam, executable: usb_cam_node, optional: true}',
        "    remap: {image: /new_1/camera/image}",
        "    subscribes: [{topic: /new_1/odom, type: nav_msgs/Odometry}]",
        "  - {by: camera-new-1, of: [new-1]}",
        '  - {by: look, of: ["@some,!new-1"]}',
        "    robots: [new-1]",
        '    record: ["/new_1/*", new_1/odom]',
        "    until: [{topic: new_1/odom, distance: 1}]",
        "multimaster: {topics: [{topic: /new_1/odom, to: [east]}]}",
        "robots: {new-1: {optional: true}}",
        "  - {by: camera-new-1, priority: 3}",
    ],
    ("program", "camera"): [
        '  more: ["@some", "host:desk", "!robot:k3", "program:new-1-k3"]',
        '  new-1: {robots: ["@some", k3], package: usb_cam, executable: usb_cam_node, optional: true}',
        "  - {by: new-1-k3, of: [k3]}",
        "  - {by: new-1-k3, priority: 3}",
    ],
    ("program", "look"): ["  new-1:", '  - {by: new-1, of: ["@some,!k3"]}', "    programs: [new-1]"],
    ("group", "some"): [
        '  new-1: ["k4-*&!k3"]',
        '  more: ["@new-1", "host:desk", "!robot:k3", "program:camera-k3"]',
        'vars: {main: pi, speed: {default: 0.1, k3: 0.2, "@new-1": 0.1}}',
        '  camera: {robots: ["@new-1", k3], package: usb_cam, executable: usb_cam_node, optional: true}',
        '  - {by: look, of: ["@new-1,!k3"]}',
    ],
    ("group", "more"): ['  new-1: ["@some", "host:desk", "!robot:k3", "program:camera-k3"]'],
}  # fmt: skip


def read(texts: Mapping[str, str], *layers: Path) -> Document:
    """The document of a spec, with other texts in place of those of some files."""
    changed = {Path(file): text.encode() for file, text in texts.items()}
    document, found = check_files(
        *layers, read=lambda path: changed[path] if path in changed else content(path)
    )
    assert document is not None, [one.message for one in found.diagnostics]
    return document


@pytest.fixture
def layers(tmp_path: Path) -> tuple[Path, Path]:
    """A spec and an overlay."""
    base, overlay = tmp_path / "swarm.yaml", tmp_path / "field.yaml"
    base.write_text(BASE)
    overlay.write_text(OVERLAY)
    return base, overlay


@pytest.mark.parametrize(("kind", "old"), CHANGED)
def test_every_reference_changes_and_nothing_else(kind: str, old: str, layers: tuple[Path, Path]) -> None:
    document = read({}, *layers)
    made = rename(document, old, "new-1", kind)
    texts = {path: made.texts.get(str(path), path.read_text()) for path in layers}
    lines = [
        (before, after)
        for path, text in texts.items()
        for before, after in zip(path.read_text().split("\n"), text.split("\n"), strict=True)
    ]
    assert [after for before, after in lines if before != after] == CHANGED[kind, old]
    made.check(document, read(made.texts, *layers))


def of_examples() -> list[tuple[Path, str, str]]:
    """Each name that an example writes out, with its kind; one of a range is none."""
    found = []
    for path in sorted((ROOT / "examples").glob("*/swarm.yaml")):
        document = read({}, path)
        data = document.source.data
        names = [(kind, name) for kind, section in KINDS.items() for name in data.get(section, {})]
        texts = "".join(document.source.texts.values())
        found += [(path, kind, name) for kind, name in names if f"  {name}:" in texts]
    return found


@pytest.mark.parametrize(("path", "kind", "old"), of_examples())
def test_an_example_means_the_same_and_can_be_renamed_back(path: Path, kind: str, old: str) -> None:
    document = read({}, path)
    made = rename(document, old, "another-1", kind)
    after = read(made.texts, path)
    made.check(document, after)
    back = rename(after, "another-1", old, kind)
    assert back.texts == {file: document.source.texts[file] for file in made.texts}


def test_what_is_not_changed_is_listed(layers: tuple[Path, Path]) -> None:
    made = rename(read({}, *layers), "k3", "new-1")
    lines = BASE.split("\n")
    mentions = made.mentions(read(made.texts, *layers))
    assert [lines[one.line - 1] for one in mentions] == [
        "    params: {frame: k3/base_link}     # k3 stays here"
    ] * 2
    assert [
        one.column for one in made.mentions_in("run.launch", b'<node ns="k3"/>\n<!-- k33, k3.urdf, my-k3 -->')
    ] == [11]


@pytest.mark.parametrize("old", ["pi", "look"])
def test_other_names_and_words_are_not_listed(old: str, layers: tuple[Path, Path]) -> None:
    made = rename(read({}, *layers), old, "new-1")
    assert not made.mentions(read(made.texts, *layers))


@pytest.mark.parametrize(
    ("old", "new", "kind", "message"),
    [
        ("k4-1", "k5", None, r"swarm\.yaml:10:3: `k4-1` is not written there by itself"),
        ("pi", "K 5", None, "`K 5` is not a name"),
        ("pi", "desk", None, "there is a host `desk` already"),
        ("pi", "pi", None, "there is a host `pi` already"),
        ("koala", "k5", None, "there is no host, robot, program or group `koala`"),
        ("desk", "k5", "robot", "there is no robot `desk`"),
        ("camera-k3", "camera-k5", None, r"swarm\.yaml:23:3: `camera-k3` is not written there by itself"),
        ("pi", "look", None, None),
        ("desk", "look", None, r"swarm\.yaml:\d+:\d+: `look` would mean one of the programs there"),
    ],
)
def test_what_cannot_be_renamed_is_refused(
    old: str, new: str, kind: str | None, message: str | None, layers: tuple[Path, Path]
) -> None:
    document = read({}, *layers)
    if message is None:
        assert rename(document, old, new, kind).texts
    else:
        with pytest.raises(RenameError, match=message):
            rename(document, old, new, kind)


def test_a_name_of_two_kinds_needs_its_kind(layers: tuple[Path, Path]) -> None:
    layers[0].write_text(rename(read({}, *layers), "k3", "pi").texts[str(layers[0])])
    layers[1].write_text("hosts: {pi: {address: 10.0.0.98}}\n")
    document = read({}, *layers)
    with pytest.raises(RenameError, match="`pi` is a host and a robot"):
        rename(document, "pi", "new-1")
    assert rename(document, "pi", "new-1", "robot").kind == "robot"


@pytest.mark.parametrize(
    ("old", "new"),
    [("k3", "k4-7"), ("k4", "k3")],  # a glob has another robot then, or one less
)
def test_a_glob_that_would_mean_something_else_is_shown(old: str, new: str, tmp_path: Path) -> None:
    path = tmp_path / "swarm.yaml"
    path.write_text(
        "version: 1\nname: lab\nmode: leader\nleader: desk\nhosts: {desk: {address: 10.0.0.2}}\n"
        f"robots:\n  {old}: {{type: khepera3, host: desk}}\n  k4-1: {{type: khepera3, host: desk}}\n"
        f"links:\n  - {{kind: serial, host: desk, robot: {old}, usb: {{serial: F1}}}}\n"
        "  - {kind: serial, host: desk, robot: k4-1, usb: {serial: F2}}\n"
        'control:\n  - {by: desk, of: ["k4*"]}\n'
    )
    document = read({}, path)
    made: Renaming = rename(document, old, new)
    with pytest.raises(RenameError, match=r"swarm\.yaml:13:20: this would mean something else"):
        made.check(document, read(made.texts, path))


def test_a_word_that_means_a_host_and_a_robot_is_shown(tmp_path: Path) -> None:
    path = tmp_path / "swarm.yaml"
    path.write_text(
        "version: 1\nname: lab\nmode: leader\nleader: k3\nhosts: {k3: {address: 10.0.0.2}}\n"
        "robots: {k3: {type: khepera3, host: k3}}\ngroups: {all: [k3]}\n"
        "links:\n  - {kind: serial, host: k3, robot: k3, usb: {serial: F1}}\n"
        'control:\n  - {by: k3, of: ["@all"]}\n'
    )
    document = read({}, path)
    made = rename(document, "k3", "new-1", "host")
    assert "groups: {all: [k3]}" in made.texts[str(path)]
    made.check(document, after := read(made.texts, path))
    assert [one.line for one in made.mentions(after)] == [7]


def test_one_of_a_range_that_others_have_is_not_changed(tmp_path: Path) -> None:
    path = tmp_path / "swarm.yaml"
    path.write_text(
        "version: 1\nname: lab\nmode: central\nhub: pi-1\n"
        "hosts:\n  pi-1: {address: 10.0.0.2}\n  pi-2: {address: 10.0.0.3}\n"
        'robots:\n  k3-[1-2]: {type: khepera3, host: "pi-[1-2]"}\n'
        "links:\n  - {kind: wlan, name: air, hosts: [pi-1, pi-2]}\n"
        '  - {kind: serial, host: "pi-[1-2]", robot: "k3-[1-2]", usb: {serial: "F[1-2]"}}\n'
    )
    with pytest.raises(RenameError, match=r"swarm\.yaml:9:36: `pi-1` is not written there by itself"):
        rename(read({}, path), "pi-1", "desk")
