"""A package.xml is refused here where catkin refuses it, and nowhere else."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator

import pytest

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes
from swarmctl.ros_packages.package_manifest import faults_of
from swarmctl.ros_packages.xml_tags import root_of
from tests.timing import PATIENCE

GOOD = """<package format="2">
  <name>nav</name>
  <version>1.2.3</version>
  <description>It <b>navigates</b>.</description>
  <maintainer email="ann.b+ros@lab.example.org">Ann</maintainer>
  <license>BSD</license>
  <url type="website">http://nav.example</url>
  <author email="b@c.example">Bob</author>
  <author>Carl</author>
  <buildtool_depend>catkin</buildtool_depend>
  <depend version_gte="1.0.0">roscpp</depend>
  <build_depend>roscpp</build_depend>
  <buildtool_export_depend>catkin</buildtool_export_depend>
  <exec_depend>std_msgs</exec_depend>
  <doc_depend>doxygen</doc_depend>
  <test_depend>rostest</test_depend>
  <export><nodelet plugin="${prefix}/a.xml"/></export>
</package>
"""
FORMAT_1 = GOOD.replace(' format="2"', "").replace("exec_depend", "run_depend")
FORMAT_1 = "\n".join(line for line in FORMAT_1.splitlines() if "<depend" not in line and "doc_" not in line)
FORMAT_1 = FORMAT_1.replace("  <buildtool_export_depend>catkin</buildtool_export_depend>\n", "")
MAIL = 'email="ann.b+ros@lab.example.org"'
#: What to replace, by what, and a part of the fault; empty where catkin takes it.
CHANGES = [
    ("", "", ""),
    ('format="2"', 'format="3"', ""),
    ('format="2"', 'format="4"', "format '4'"),
    ('format="2"', 'format="2" state="new"', "<package> in line 1 with the unknown attribute 'state'"),
    ('format="2"', 'xmlns="http://x" a:b="c" xmlns:a="http://a" format="2"', ""),
    ("<name>nav</name>", "", "no <name>"),
    ("1.2.3", "1.2", "version '1.2' in line 3"),
    ("1.2.3", " 1.2.3\n ", ""),
    ("1.2.3", "01.2.3", ""),
    ("<version>", '<version compatibility="1.0.0">', ""),
    ("<version>", '<version compatibility="1">', "`compatibility`"),
    ("<version>1.2.3</version>", "<version>1.2.3</version><version>1.2.4</version>", "2 <version>"),
    ("It <b>navigates</b>.", "<b/>", ""),
    ("It <b>navigates</b>.", " ", "empty <description>"),
    (MAIL, "", "without `email`"),
    (MAIL, 'email=""', "without `email`"),
    (MAIL, 'email="a@b.c"', "the email 'a@b.c' in line 5"),
    (MAIL, 'email="a@b.example" phone="1"', "attribute 'phone'"),
    (MAIL, 'email="a (at) b.example"', "the email"),
    ("b@c.example", "nobody", "the email 'nobody'"),
    ("<license>BSD</license>", "", "no <license>"),
    ("BSD", " ", "empty <license>"),
    ("<license>", '<license file="LICENSE">', "attribute 'file'"),
    (">std_msgs<", "><b>std_msgs</b><", "must not have tags"),
    (">std_msgs<", ">nav<", "on the package itself"),
    (">std_msgs<", ' condition="$ROS_VERSION == 1">std_msgs<', "attribute 'condition'"),
    ("exec_depend", "run_depend", "<run_depend> in line 14, which format 2"),
    ("<exec_depend>std_msgs", "<exec_depend>roscpp", ""),
    ('<depend version_gte="1.0.0">', "<depend>", "keep one"),
    ("</export>", "</export><export/>", "more than one <export>"),
    ("<license>", "<member_of_group>g</member_of_group><license>", "<member_of_group>"),
    ("<license>", "<package/><license>", "<package> in line 6"),
    ("<license>", "<colour>red</colour><license>", "<colour> in line 6"),
    ("<license>", "<conflict>nav</conflict><license>", ""),
    ("<license>", "<build_depend>rostest</build_depend><license>", ""),
]
FORMAT_1_CHANGES = [
    ("", "", ""),
    ("run_depend", "exec_depend", "<exec_depend>"),
    (">rostest<", ">std_msgs<", "keep one"),
    ("</test_depend>", "</test_depend><run_depend>rostest</run_depend>", "keep one"),
    ("</test_depend>", "</test_depend><build_depend>rostest</build_depend>", "keep one"),
    (">std_msgs<", ">nav<", "on the package itself"),
]
CATKIN = """
import json, sys
from catkin_pkg.package import parse_package_string
def fault(text):
    try:
        parse_package_string(text, "package.xml", warnings=[])
    except Exception as error:
        return str(error) or type(error).__name__
    return ""
print(json.dumps([fault(text) for text in json.load(sys.stdin)]))
"""


def cases() -> Iterator[tuple[str, str]]:
    for text, changes in ((GOOD, CHANGES), (FORMAT_1, FORMAT_1_CHANGES)):
        for old, new, fault in changes:
            assert old in text
            yield (text.replace(old, new) if old else text), fault


@pytest.mark.parametrize(("text", "fault"), list(cases()))
def test_what_catkin_refuses_is_named(text: str, fault: str) -> None:
    found = list(faults_of(root_of(text.encode())))
    assert bool(found) == bool(fault), found
    assert fault in " ".join(found)


@pytest.mark.lab
def test_catkin_itself_refuses_the_same() -> None:
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    disk = image.ensure(lambda _line: None)
    texts = [text for text, _ in cases()]
    ran = subprocess.run(
        ["chroot", disk, "/usr/bin/python3", "-B", "-c", CATKIN],
        input=json.dumps(texts), capture_output=True, text=True, check=True, timeout=PATIENCE,
    )  # fmt: skip
    own = [bool(list(faults_of(root_of(text.encode())))) for text in texts]
    theirs = json.loads(ran.stdout)
    assert [
        (text, one) for text, one, other in zip(texts, theirs, own, strict=True) if bool(one) != other
    ] == []
