"""URDFs beside a spec whose frames do not fit the robot (URDF005)."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.diagnostics import Diagnostic
from tests.loading import load_checked

SPEC = """\
version: 1
name: seen
mode: central
hub: pi
time: {servers: [pool.ntp.org]}
packages:
  rover_description: {from: ./rover_description}
hosts:
  pi: {address: 192.168.77.12, user: robot, has: [camera]}
robots:
  k3: {type: khepera3, host: pi, urdf: own.urdf}
  p3: {type: pioneer3, host: pi, urdf: p3.urdf}
links:
  - {kind: serial, host: pi, robot: k3, usb: {serial: K3}}
  - {kind: serial, host: pi, robot: p3, usb: {serial: P3}}
programs: {}
"""
WHEELS = """
  <link name="left_wheel_link" />
  <joint name="left_wheel" type="continuous">
    <parent link="base_link" /><child link="left_wheel_link" />
  </joint>
"""
MESH = '<visual><geometry><mesh filename="package://{}" /></geometry></visual>'
PACKAGE = """<package format="2"><name>{}</name><version>0.0.0</version><description>its shape</description>
<maintainer email="swarmctl@swarmctl.invalid">swarmctl</maintainer><license>Apache-2.0</license></package>
"""


def link(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, kind: str, parent: str, child: str) -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}" /><child link="{child}" /></joint>'


def urdf(*parts: str) -> str:
    return f'<robot name="it">{"".join(parts)}</robot>'


def found(
    folder: Path,
    own: str = urdf(link("base_link")),
    p3: str = urdf(link("base_link")),
    *changes: tuple[str, str],
) -> list[Diagnostic]:
    """What is found about the spec with these URDFs of its two robots."""
    text = SPEC
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    package = folder / "rover_description"
    (package / "meshes").mkdir(parents=True, exist_ok=True)
    (package / "package.xml").write_text(PACKAGE.format(package.name))
    (package / "meshes/body.stl").write_text("solid body\nendsolid body\n")
    (folder / "own.urdf").write_text(own)
    (folder / "p3.urdf").write_text(p3)
    (folder / "swarm.yaml").write_text(text)
    return list(load_checked(folder / "swarm.yaml")[1])


def test_urdfs_that_fit_have_no_finding(tmp_path: Path) -> None:
    mesh = MESH.format("rover_description/meshes/body.stl")
    assert found(tmp_path, urdf(link("base_link", mesh), WHEELS)) == []


def test_a_urdf_beyond_the_limits_is_not_called_wrong(tmp_path: Path) -> None:
    (one,) = found(tmp_path, urdf(link("base_link", "<a>" * 40 + "</a>" * 40)))
    assert (one.code, one.label) == ("URDF002", "the URDF of a robot")
    assert one.message.startswith("own.urdf:1:")
    assert "cannot be checked" in one.message


@pytest.mark.parametrize(
    ("own", "code", "message"),
    [
        (
            urdf(link("root"), link("base_link"), joint("b", "fixed", "root", "base_link")),
            "URDF005", "`base_link` is below `root`",
        ),
        (urdf(link("chassis")), "URDF005", "it has no link `base_link`"),
        (
            urdf(link("base_link"), link("proximity_front_left"),
                 joint("s", "fixed", "base_link", "proximity_front_left")),
            "URDF005", "publishes the frame of the sensor `proximity_front_left` as well",
        ),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_found(tmp_path: Path, own: str, code: str, message: str) -> None:
    (one,) = found(tmp_path, own)
    assert one.code == code
    assert message in one.message
    assert "own.urdf:1:" in one.message
    assert one.span is not None
    assert one.span.line == SPEC.splitlines().index(next(x for x in SPEC.splitlines() if "k3:" in x)) + 1


def test_a_packages_own_base_frame_is_the_root(tmp_path: Path) -> None:
    """`pioneer3` gives RosAria `base_link_frame`."""
    (one,) = found(tmp_path, p3=urdf(link("base_footprint")))
    assert one.code == "URDF005"
    assert "it has no link `base_link`, whose pose its driver publishes" in one.message
    assert "p3.urdf:1:" in one.message


def test_a_robots_own_urdf_replaces_that_of_its_type(tmp_path: Path) -> None:
    """A file that no robot has is still checked as a URDF, not against robots."""
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/cart.yaml").write_text(
        "title: Cart\ndriver: {package: cart, executable: cart}\nurdf: type.urdf\n"
        "kinematics: {kind: differential, linear_max: 1.0, angular_max: 1.0}\n"
    )
    (tmp_path / "type.urdf").write_text("<robot>")
    change = ("type: pioneer3, host: pi", "type: cart, host: pi")
    no_link = ("  - {kind: serial, host: pi, robot: p3, usb: {serial: P3}}\n", "")
    (one,) = found(tmp_path, urdf(link("base_link")), urdf(link("x")), change, no_link)
    assert one.code == "URDF002"
    assert one.span is not None
    assert Path(one.span.file).name == "cart.yaml"
    (tmp_path / "type.urdf").write_text(urdf(link("x")))
    assert found(tmp_path, urdf(link("base_link")), urdf(link("x")), change, no_link) == []
