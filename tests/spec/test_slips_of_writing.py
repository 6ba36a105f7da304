"""What people write on the first day: the finding names the line and leads to the repaired spec."""

from __future__ import annotations

import pytest

from swarmctl.diagnostics import Diagnostic
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.yamltext.edits import apply

SPEC = """\
version: 1
name: lab
mode: leader
leader: base
hosts:
  base:
    address: 10.0.0.1
    user: robot
    computer: laptop
  k3-pi: {address: 10.0.0.2}
robots:
  k3:
    type: khepera3
    host: k3-pi
    settings: {limits: {linear: 0.2}}
links:
  - kind: wlan
    name: lab
    hosts: [base, k3-pi]
    multicast: true
  - kind: serial
    host: k3-pi
    robot: k3
    usb: {serial: FTDI1234, vendor: "0403"}
    baud: 115200
control:
  - by: base
    of: [k3]
"""


def found_in(text: str) -> tuple[Diagnostic, ...]:
    return load_text(text, "swarm.yaml", load_catalog())[1]


def line_of(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


def test_the_spec_itself_is_right() -> None:
    assert found_in(SPEC) == ()


@pytest.mark.parametrize(
    ("right", "wrong", "message", "help_"),
    [
        (
            "name: lab\nmode",
            "name:lab\nmode",
            "a blank is missing behind this colon",
            "write it like `name: lab`",
        ),
        ("address: 10.0.0.1", "address:10.0.0.1", "a blank is missing behind this colon", "name: lab"),
        ("- by: base", "-by: base", "a blank is missing behind this dash", "with `- `"),
        ("- by: base", "\u2013 by: base", "this is not the dash of a list", "hyphen of the keyboard"),
        ("hosts:\n", "hosts\n", "this key has no colon", "write it like"),
        ("version: 1\n", "```yaml\nversion: 1\n", "three backticks are Markdown", "remove the lines"),
        ("of: [k3]", "of: *", "a name is missing", "a list names each entry"),
        ("address: 10.0.0.1", "address: ?", "a value cannot be `?`", "write the value"),
        ("address: 10.0.0.1", 'address: "{{ ip }}"', "neither an IP address", "no variables"),
        ("address: 10.0.0.1", "address: ${IP}", "neither an IP address", "no variables"),
        ("address: 10.0.0.1", "address: <ip>", "neither an IP address", "no variables"),
        ("address: 10.0.0.1", "address: 10.1", "`address` must be text", "Where the others reach it"),
        ('vendor: "0403"', "vendor: 0x0403", "`vendor` must be text", "four hexadecimal digits"),
        ("computer: laptop", "computer: laptop# fast", "`computer` cannot be", "write laptop # ..."),
        ("computer: laptop", "computer: laptop // fast", "`computer` cannot be", "write laptop # ..."),
        ("hosts: [base, k3-pi]", "hosts: [base k3-pi]", "entry 1 of `hosts`", "write commas: base, k3-pi"),
        ("hosts: [base, k3-pi]", "hosts: (base, k3-pi)", "must be a list", "[base, k3-pi]"),
        ("linear: 0.2", "linear:0.2", "unknown key `linear:0.2`", "behind the colon: linear: 0.2"),
        ("linear: 0.2", "linear: 0,2", "`linear` cannot be `0`", ""),
        ("baud: 115200", "baud: 115200 8N1", "must be a whole number", "Bits per second"),
    ],
)
def test_a_slip_is_found_in_its_line_with_help(right: str, wrong: str, message: str, help_: str) -> None:
    assert SPEC.count(right) == 1
    text = SPEC.replace(right, wrong)
    found, *_ = (one for one in found_in(text) if message in one.message)
    assert found.span is not None
    assert found.span.line == line_of(text, wrong)
    assert help_ in "\n".join(found.help)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("host: k3-pi\n    settings", "host: k3-pi\n    namespace: /lab/k-3\n    settings"),
        ("user: robot", "user: robot,"),
        ("user: robot", "user: robot;"),
        ("user: robot", "user: \u201crobot\u201d"),
        ("user: robot", "ansible_user: robot"),
        ("address: 10.0.0.1", "address: 10.0.0.1,"),
        ("address: 10.0.0.1", "ansible_host: 10.0.0.1"),
        ("baud: 115200", "baud: 115200,"),
        ("baud: 115200", "baud: 1.152e5"),
        ("multicast: true", "multicast: enabled"),
        ("multicast: true", "multicast: 1"),
        ("hosts: [base, k3-pi]", "hosts: {base, k3-pi}"),
        ("{address: 10.0.0.2}", "10.0.0.2"),
    ],
)
def test_its_fix_makes_the_spec_right_again(right: str, wrong: str) -> None:
    assert SPEC.count(right) == 1
    text = SPEC.replace(right, wrong)
    fixes = [one.fix for one in found_in(text) if one.fix is not None]
    assert len(fixes) == 1
    assert found_in(apply(text, fixes[0].edits)) == ()


@pytest.mark.parametrize("text", ["[hosts.k3]\naddress = 1\n", SPEC.replace("robots:", "...\nrobots:")])
def test_text_behind_the_end_of_a_document_gets_help(text: str) -> None:
    (found,) = found_in(text)
    assert "does not belong" in found.message
    assert "one document" in found.help[0]


def test_no_fix_joins_names_that_lack_a_comma() -> None:
    assert all(one.fix is None for one in found_in(SPEC.replace("[base, k3-pi]", "[base k3-pi]")))


@pytest.mark.parametrize(
    ("name", "meant"), [("schw\u00e4rm", "schwaerm"), ("Stra\u00dfe", "strasse"), ("caf\u00e9", "cafe")]
)
def test_letters_with_marks_become_plain_ones(name: str, meant: str) -> None:
    (found,) = found_in(SPEC.replace("name: lab\nmode", f"name: {name}\nmode"))
    assert f"write it `{meant}`" in found.help[0]


@pytest.mark.parametrize("odd", ["baud:\u00a0115200", "baud:115200"])
def test_a_value_stuck_to_its_key_is_one_finding(odd: str) -> None:
    """It has no warning about a missing value beside it."""
    text = SPEC.replace('usb: {serial: FTDI1234, vendor: "0403"}', f"usb: {{serial: FTDI1234, {odd}}}")
    assert [one.code for one in found_in(text)] == ["SPEC001"]


def test_entries_of_a_list_where_names_belong_get_help() -> None:
    listed = SPEC.replace("  k3:\n    type", "  - name: k3\n    type")
    assert "`NAME:` in place of `-`" in found_in(listed)[0].help[0]
