"""A number that is none, or too large: wherever one is wanted, the answer is a finding with its place."""

from __future__ import annotations

import os
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from swarm_onboard.driver.config import parse

from swarmctl.analysis.budgets import budgets_of
from swarmctl.diagnostics import has_errors
from swarmctl.linter.runner import lint
from swarmctl.render.build_bundle import bundles
from swarmctl.spec.catalog import Catalog, load_catalog
from swarmctl.spec.load import load_text
from swarmctl.swarm.index import SwarmIndex
from swarmctl.swarm.resolve import resolve
from tests import ROOT

EXAMPLES = int(os.environ.get("SWARMCTL_FUZZ", "150"))
ODD = (".inf", "-.inf", ".nan", "1e400", "1" + "0" * 400, "9" * 18, "0x7fffffffffffffff", "1e308", "1e-320",
       "0", "-1", "0.5", "true", "2026-11-21", "~")  # fmt: skip
EVERYTHING = """\
version: 1
name: odd
mode: single-minded
leader: pi
defaults:
  robot: {command_timeout: 0.4, rates: {diagnostics: 1}}
hosts:
  pi: {address: 192.168.77.40, user: robot, computer: raspberry-pi-4b, port: 22}
robots:
  koala:
    type: koala
    settings:
      rates: {proximity: 5}
      limits: {linear: 0.2, angular: 1.5}
      calibration: {wheel_separation: 0.33, distance_scale: 1.02}
  rover:
    type: arduino-rover
    settings:
      firmware: {pulses_per_turn: 20, left: {encoder: 2}}
links:
  - {kind: serial, host: pi, robot: koala, baud: 38400, usb: {serial: K1}}
  - {kind: serial, host: pi, robot: rover, usb: {serial: R1}}
  - {kind: wlan, name: lab, hosts: [pi], capacity_mbps: 20}
programs:
  wander:
    host: pi
    package: wanderer
    executable: wander
    params: {speed: 0.2, count: 3}
    publishes: [{topic: view, type: sensor_msgs/Image, rate: 5.0, size: 1000}]
    memory_mb: 300
"""
ONE = """\
version: 1
name: odd
mode: single-minded
leader: pi
hosts:
  pi: {{address: 192.168.77.40, user: robot, computer: raspberry-pi-4b}}
robots:
  r: {{type: {type}}}
links:
  - {link}
"""


def numbers(node: yaml.Node) -> Iterator[tuple[int, int]]:
    """Where each number of a document begins and ends."""
    if isinstance(node, yaml.MappingNode):
        for _, value in node.value:
            yield from numbers(value)
    elif isinstance(node, yaml.SequenceNode):
        for value in node.value:
            yield from numbers(value)
    elif node.tag in ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float"):
        yield node.start_mark.index, node.end_mark.index


def variants(text: str) -> list[str]:
    """The text with each number in turn replaced by each odd value."""
    places = list(numbers(yaml.compose(text)))
    return [text[:begin] + odd + text[end:] for (begin, end), odd in product(places, ODD)]


TYPES = {file.stem: file.read_text("utf-8") for file in sorted((ROOT / "templates/robots").glob("*.yaml"))}
SPECS = [EVERYTHING, *(file.read_text("utf-8") for file in sorted(ROOT.glob("examples/*/swarm.yaml")))]
ODD_TYPES = st.deferred(
    lambda: st.sampled_from([(name, text) for name, whole in TYPES.items() for text in variants(whole)])
)
ODD_SPECS = st.deferred(lambda: st.sampled_from([text for whole in SPECS for text in variants(whole)]))
CATALOG = load_catalog()
many = settings(
    max_examples=EXAMPLES, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)


def answered(text: str, catalog: Catalog, counted: list[str]) -> None:
    """The whole road of a spec: found wrong at a place of the text, or on it goes to what the robots' drivers
    read.
    """
    document, found = load_text(text, "swarm.yaml", catalog)
    found = (*found, *(lint(document) if document else ()))
    assert all(one.span is not None for one in found)
    assert all((one.span.line, one.span.column) > (1, 1) for one in found if one.span)
    if document is None or has_errors(found):
        return
    budgets_of(SwarmIndex(document))
    for bundle in bundles(resolve(document)).values():
        for file in bundle.files:
            if file.path.startswith("params/") and b"kinematics" in file.content:
                parse(yaml.safe_load(file.content))
                counted.append(file.path)


@many
@given(ODD_TYPES)
def test_an_odd_number_in_a_type_is_found_or_driven_with(
    tmp_path: Path, counted: list[str], odd: tuple[str, str]
) -> None:
    name, text = odd
    (tmp_path / f"{name}.yaml").write_text(text)
    link = "{kind: bluetooth, host: pi, robot: r, mac: '10:00:e8:c5:64:37'}"
    if "kinds:" not in text:
        link = ""
    elif "serial" in text.split("kinds:")[1][:30]:
        link = "{kind: serial, host: pi, robot: r, usb: {serial: R1}}"
    answered(ONE.format(type=name, link=link), load_catalog(tmp_path), counted)


@many
@given(ODD_SPECS)
def test_an_odd_number_in_a_spec_is_found_or_rendered(counted: list[str], odd: str) -> None:
    answered(odd, CATALOG, counted)
