"""What a URDF is for ROS: the same verdict as that of `check_urdf`, with the place of the fault."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.ros_packages.urdf import UrdfError, UrdfTooLargeError, read_urdf
from tests.timing import work_at_most


def link(name: str) -> str:
    return f'<link name="{name}" />'


def joint(name: str, parent: str, child: str, kind: str = "fixed", inside: str = "") -> str:
    ends = f'<parent link="{parent}" /><child link="{child}" />'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'


ONE, TWO = link("a"), link("a") + link("b")
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1" />'
LOST = "a circle beside the root"  # which check_urdf leaves out without a word
#: By what it shows: the elements of a file, and a word of its fault; empty if it is right.
FILES = {
    "one link": (ONE, ""),
    "a tree": (TWO + link("c") + joint("j", "a", "b") + joint("k", "a", "c"), ""),
    "a joint with limits": (TWO + joint("j", "a", "b", "revolute", LIMIT), ""),
    "joints of a transmission": (ONE + '<transmission name="t"><joint name="none" /></transmission>', ""),
    "no link": ("", "no link"),
    "two links of one name": (ONE + ONE, "two links are called `a`"),
    "two joints of one name": (
        TWO + link("c") + joint("j", "a", "b") + joint("j", "a", "c"),
        "two joints are called `j`",
    ),
    "a link without a name": (ONE + "<link />", "a <link> has no `name`"),
    "two roots": (TWO, "a URDF has one root"),
    "a circle": (TWO + joint("j", "a", "b") + joint("k", "b", "a"), "a circle"),
    LOST: (TWO + link("c") + joint("j", "b", "c") + joint("k", "c", "b"), "a circle"),
    "an unknown parent": (TWO + joint("j", "x", "b"), "the parent `x`, which is not a link"),
    "an unknown child": (ONE + joint("j", "a", "x"), "the child `x`, which is not a link"),
    "no type": (TWO + joint("j", "a", "b", ""), "has no `type`"),
    "an unknown type": (TWO + joint("j", "a", "b", "hinge"), "has the type `hinge`"),
    "no limits": (TWO + joint("j", "a", "b", "prismatic"), "has no <limit>"),
    "a mesh without a file": (
        '<link name="a"><visual><geometry><mesh /></geometry></visual></link>',
        "has no `filename`",
    ),
}


def document(elements: str) -> bytes:
    return f'<?xml version="1.0"?>\n<robot name="it">\n{elements}\n</robot>\n'.encode()


@pytest.mark.parametrize(("elements", "fault"), FILES.values(), ids=FILES.keys())
def test_faults_are_found_where_they_stand(elements: str, fault: str) -> None:
    found = read_urdf(document(elements))
    texts = [one.text for one in found.faults]
    assert bool(texts) == bool(fault)
    assert any(fault in one for one in texts) or not fault
    assert {one.place.line for one in found.faults} <= {2, 3}


@pytest.mark.skipif(
    shutil.which("check_urdf") is None, reason="check_urdf is missing: apt install liburdfdom-tools"
)
def test_check_urdf_refuses_the_same_files(tmp_path: Path) -> None:
    for name, (elements, fault) in FILES.items():
        file = tmp_path / "it.urdf"
        file.write_bytes(document(elements))
        done = subprocess.run(["check_urdf", str(file)], capture_output=True, text=True, check=False)
        printed = done.stdout + done.stderr
        refused = done.returncode != 0 or "Error:" in printed
        assert refused == (bool(fault) and name != LOST), (name, printed)


@pytest.mark.parametrize(
    ("content", "text", "place"),
    [
        (b"<robot>\n  <link>\n</robot>", "not well-formed", (3, 3)),
        (b"", "not well-formed", (1, 1)),
        (b"\n<sdf />", "its root is <sdf>", (2, 1)),
        (b"<robot name='\xe9' />", "not UTF-8", (1, 14)),
        (b'<!DOCTYPE a [<!ENTITY b "c">]>\n<robot />', "entities or a document type", (1, 13)),
        (
            b'<robot xmlns:x="http://wiki.ros.org/xacro" name="r">\n <x:macro name="m" />\n</robot>',
            "xacro", (2, 2),
        ),
        (
            b'<robot xmlns:x="http://wiki.ros.org/xacro" name="r">\n <link name="${p}base" />\n</robot>',
            "xacro", (2, 2),
        ),
    ],
)  # fmt: skip
def test_what_is_no_urdf_is_refused(content: bytes, text: str, place: tuple[int, int]) -> None:
    with pytest.raises(UrdfError) as error:
        read_urdf(content)
    assert text in error.value.fault.text
    assert (error.value.fault.place.line, error.value.fault.place.column) == place


def test_the_output_of_xacro_is_taken() -> None:
    """It still declares the namespace."""
    content = b'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a" /></robot>'
    assert read_urdf(content).root == "a"


NAMES = st.sampled_from("abcde")


@given(st.lists(NAMES, max_size=5, unique=True), st.lists(st.tuples(NAMES, NAMES), max_size=6))
def test_without_faults_every_link_leads_to_the_root(links: list[str], pairs: list[tuple[str, str]]) -> None:
    joints = "".join(joint(f"j{number}", *ends) for number, ends in enumerate(pairs))
    found = read_urdf(document("".join(map(link, links)) + joints))
    parents = {child: parent for parent, child in pairs}

    def top(name: str) -> str:
        for _ in links:
            name = parents.get(name, name)
        return name

    known = {name for pair in pairs for name in pair} <= set(links)
    is_tree = known and len(parents) == len(pairs) == len(links) - 1 and len({top(one) for one in links}) == 1
    assert is_tree == (not found.faults)
    assert not is_tree or {top(one) for one in links} == {found.root}


@pytest.mark.parametrize("elements", ['<link name="a" />' * 20_001, "<a>" * 40 + "</a>" * 40])
def test_a_file_beyond_the_limits_is_not_called_wrong(elements: str) -> None:
    with pytest.raises(UrdfTooLargeError):
        read_urdf(document(elements))


def test_a_long_text_takes_time_by_its_length() -> None:
    text = document(link("a") + "&amp;\n" * 400_000)
    with work_at_most(100):  # it is 1000 if each piece is a copy of all before
        read_urdf(text)
