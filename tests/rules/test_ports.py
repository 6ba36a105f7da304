"""Every clash of ports is found, and its fix removes it."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.diagnostics import Diagnostic
from swarmctl.linter.runner import lint
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.swarm.ports import free_master_port
from swarmctl.yamltext.edits import apply

SPEC = """
version: 1
name: box
mode: standalone
hosts:
  one: {{address: 192.168.77.10, port: {ssh}, master_port: {first}}}
  two: {{address: 192.168.77.10, port: 2223, master_port: {second}}}
robots: {{koala: {{type: koala, host: one}}}}
links:
  - {{kind: wlan, name: lab, hosts: [one, two]}}
  - {{kind: serial, host: one, robot: koala, device: /dev/ttyS0}}
"""


def found_in(text: str, prefix: str = "PORT") -> list[Diagnostic]:
    document, problems = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None, problems
    return [one for one in lint(document) if one.code.startswith(prefix)]


@pytest.mark.parametrize(
    ("ssh", "first", "second", "codes"),
    [
        (22, 11311, 11312, []),
        (22, 11311, 11311, ["PORT001"]),
        (22, 11311, 11611, ["PORT001"]),
        (22, 11611, 11311, ["PORT001"]),
        (11611, 11311, 12000, ["PORT001"]),
        (22, 11311, 11911, ["PORT002"]),
        (22, 11311, 12321, ["PORT002"]),
        (22, 11311, 65235, []),
        (22, 11311, 1024, []),
        (22, 11311, 32767, ["PORT005"]),  # its discovery listens above
        (22, 11311, 32467, []),
        (22, 11311, 61000, []),
    ],
)
def test_who_takes_whose_port(ssh: int, first: int, second: int, codes: list[str]) -> None:
    found = found_in(SPEC.format(ssh=ssh, first=first, second=second))
    assert [one.code for one in found] == codes


@settings(max_examples=50)
@given(
    first=st.integers(11311, 12400),
    offset=st.sampled_from([0, 300, -300, 600, -600, 1010, -1010]),
    ssh=st.sampled_from([22, 11311, 11312, 11611]),
)
def test_the_fix_of_a_port_conflict_removes_it(first: int, offset: int, ssh: int) -> None:
    text = SPEC.format(ssh=ssh, first=first, second=first + offset)
    for _ in range(3):  # three clashes at most: two masters, an SSH server with each
        found = found_in(text, "PORT00")
        if not found:
            break
        assert found[0].fix is not None
        text = apply(text, found[0].fix.edits)
    assert found_in(text) == []


def test_a_port_is_free_with_all_that_counts_from_it() -> None:
    assert free_master_port(set(), (0,)) == 11311
    assert free_master_port({11311, 11612}, (0, 300)) == 11313
    assert free_master_port(range(65536), (0,)) is None
