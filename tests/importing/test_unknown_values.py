"""What depends on a substitution that only the host has is to fill in, or not read for that reason."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.importing.drafts import draft, lab

ARGS = (
    '<arg name="n" default="$(eval 1 + 1)"/><arg name="e" default="$(optenv E hunter2)"/>'
    '<arg name="p" value="x$(arg e)"/>\n'
)
WORDS = {"at": "x.launch:2: ", "if": "whether it applies depends on"}
INNER = '<launch><arg name="i"/><node pkg="p" type="t" name="n" if="$(arg i)"/></launch>'


def text(*lines: str) -> Mapping[str, str]:
    return {
        "a.sh": "ROS_HOSTNAME=a\n",
        "x.launch": f"<launch>{ARGS}{''.join(lines)}</launch>",
        "i.launch": INNER,
    }


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ('<machine name="m" address="m" if="$(eval 1)"/>', "# address: m  # fill in: {at}{if} $(eval)"),
        ('<machine name="m" address="m" unless="$(arg n)"/>', "# address: m  # fill in: {at}{if} $(eval)"),
        (
            '<group if="$(arg p)"><group><machine name="m" address="m"/></group></group>',
            "# fill in: {at}{if} $(optenv E)",
        ),
        ('<machine name="m" address="m$(arg n)"/>', "# fill in: {at}`address` depends on $(eval)"),
        (
            '<machine name="m" address="m" user="$(env U)"/>',
            "# user: robot  # fill in: {at}`user` depends on $(env U)",
        ),
        (
            '<machine name="m" address="m" ssh-port="$(env P)"/>',
            "# port: 22  # fill in: {at}`ssh-port` depends on $(env P)",
        ),
        ('<machine name="$(anon m)" address="m"/>', "#   {at}`name` depends on $(anon m)"),
        (
            '<node pkg="p" type="t" name="go" if="$(eval 1)"/>',
            "# go: {{host: a, package: p, executable: t}}  # fill in: {at}{if} $(eval)",
        ),
        ('<node pkg="koala" type="koala" name="n" if="$(eval 1)"/>', "#   {at}{if} $(eval)"),
        (
            '<node pkg="p" type="t" name="n" machine="$(arg p)"/>',
            "# host: a  # fill in: {at}`machine` depends on $(optenv E)",
        ),
        (
            '<node pkg="p" type="t" name="n" args="$(arg n)"/>',
            "# args: []  # fill in: {at}`args` depends on $(eval)",
        ),
        ('<node pkg="p" type="t" name="n$(arg n)"/>', "# fill in: {at}`name` depends on $(eval)"),
        ('<group ns="$(arg n)"><node pkg="p" type="t" name="n"/></group>', "#   {at}`ns` depends on $(eval)"),
        (
            '<node pkg="p" type="t" name="n"><param name="r" value="$(arg n)"/></node>',
            "#   {at}`value` depends on $(eval)",
        ),
        (
            '<node pkg="p" type="t" name="n"><param name="r" value="1" if="$(arg n)"/></node>',
            "#   {at}{if} $(eval)",
        ),
        (
            '<arg name="q" value="1" if="$(eval 1)"/><node pkg="p" type="t" name="n$(arg q)"/>',
            "# fill in: {at}`name` depends on $(eval)",
        ),
        ('<include file="$(find q)/$(env F)"/>', "#   {at}`file` depends on $(env F)"),
        (
            '<include file="$(dirname)/i.launch"><arg name="i" value="$(arg n)"/></include>',
            "# fill in: i.launch:1: {if} $(eval)",
        ),
        (
            '<include file="$(dirname)/i.launch" unless="$(arg n)"><arg name="i" value="1"/></include>',
            "# fill in: i.launch:1: {if} $(eval)",
        ),
    ],
)
def test_the_reason_names_the_substitution(line: str, shown: str, tmp_path: Path) -> None:
    found = draft(lab(tmp_path, text(line))).text
    assert shown.format(**WORDS) in found
    assert "hunter2" not in found


def test_both_addresses_of_a_machine_are_to_fill_in(tmp_path: Path) -> None:
    machines = (f'<machine name="m" address="m{one}" {one}="$(arg n)"/>\n' for one in ("if", "unless"))
    found = draft(lab(tmp_path, text(*machines))).text
    because = "whether it applies depends on $(eval)"
    assert f"# fill in: x.launch:2: {because}; x.launch:3: {because}\n" in found


def test_a_node_that_may_start_shows_no_mode(tmp_path: Path) -> None:
    files = {**text('<node pkg="p" type="t" name="n" if="$(arg n)"/>'), "b.sh": "ROS_HOSTNAME=b\n"}
    files["a.sh"] += "ROS_MASTER_URI=http://a:11311\n"
    files["b.sh"] += "ROS_MASTER_URI=http://a:11311\n"
    assert "mode: central" in draft(lab(tmp_path, files)).text
