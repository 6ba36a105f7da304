"""Every mode into every mode: the result is valid, and its wiring is that of the target mode."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from swarmctl.diagnostics import has_errors
from swarmctl.linter.runner import lint
from swarmctl.mode_conversion.convert import Conversion, converted
from swarmctl.mode_conversion.infer import ArrangementError, infer
from swarmctl.mode_conversion.ros_conversion import for_distro
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import Document, load_text
from swarmctl.spec.model import Mode
from swarmctl.swarm.index import SwarmIndex
from tests import ROOT

FOLDER = Path(__file__).parent / "modes"
MODES = [mode.value for mode in Mode]


def document_of(text: str) -> Document:
    document, found = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None, found
    assert not has_errors(lint(document)), lint(document)
    return document


@pytest.fixture(params=MODES)
def document(request: pytest.FixtureRequest) -> Document:
    return document_of((FOLDER / f"{request.param}.yaml").read_text("utf-8"))


def test_the_inferred_mode_is_the_declared_mode(document: Document) -> None:
    assert infer(SwarmIndex(document)).mode is document.spec.mode


def conversion_of(document: Document, to: str) -> Conversion | None:
    """The conversion; None if it is refused, which needs a commander other than the leader."""
    try:
        return converted(document, Mode(to))
    except ArrangementError:
        assert to in ("leader", "single-minded")
        assert document.spec.mode.value in ("central", "standalone", "combined")
        assert len({control.by for control in document.spec.control}) > 1
        return None


@pytest.mark.parametrize("to", MODES)
def test_a_conversion_is_valid_and_infers_to_its_target(document: Document, to: str) -> None:
    if (conversion := conversion_of(document, to)) is None:
        return
    assert conversion.undone == ()
    result = document_of(conversion.text)
    assert result.spec.mode is Mode(to)
    assert infer(SwarmIndex(result)).mode is Mode(to)
    assert set(result.spec.robots) == set(document.spec.robots)
    assert set(result.spec.hosts) == set(document.spec.hosts)


def test_a_conversion_to_the_same_mode_changes_nothing(document: Document) -> None:
    conversion = converted(document, document.spec.mode)
    assert conversion.text == document.source.text
    assert (conversion.changes, conversion.by_hand) == ((), ())


@pytest.mark.parametrize("to", MODES)
def test_a_conversion_keeps_comments(document: Document, to: str) -> None:
    if (conversion := conversion_of(document, to)) is None:
        return
    text = conversion.text
    for comment in ("# the robots of the lab", "# the one with the scratch"):
        assert comment in text


def test_one_host_cannot_become_standalone() -> None:
    text = """
version: 1
name: alone
mode: single-minded
leader: laptop
hosts: {laptop: {address: 192.168.77.10}}
robots: {koala: {type: koala}}
links: [{kind: serial, host: laptop, robot: koala, usb: {serial: A600dXyz}}]
"""
    with pytest.raises(ArrangementError, match="needs a second computer"):
        converted(document_of(text), Mode.STANDALONE)


def test_islands_of_two_distributions_keep_their_mode() -> None:
    document = document_of((ROOT / "examples/ros1-and-ros2/swarm.yaml").read_text("utf-8"))
    with pytest.raises(ArrangementError, match="a ROS distribution of their own"):
        converted(document, Mode.CENTRAL)
    alike = document_of(for_distro(document, "jazzy").text)
    assert {one.distro for one in SwarmIndex(alike).islands} == {"jazzy"}
    assert converted(alike, Mode.CENTRAL).undone == ()


def test_a_conversion_lists_the_steps_left_to_a_person() -> None:
    document = document_of((FOLDER / "leader.yaml").read_text("utf-8"))
    assert converted(document, Mode.SINGLE_MINDED).by_hand == (
        "plug the line of `k3` into `koala-laptop` instead of `k3-pi`",
        "pair `epuck` with a Bluetooth adapter of `koala-laptop`",
    )


@st.composite
def swarms(draw: st.DrawFn) -> str:
    """A swarm of two to five hosts in mode leader or central; any host may command any robot once."""
    hosts = [f"h{number}" for number in range(draw(st.integers(2, 5)))]
    robots = {f"r{number}": draw(st.sampled_from(hosts)) for number in range(draw(st.integers(1, 6)))}
    assume(set(robots.values()) - {"h0"})
    lines = ["version: 1", "name: drawn", f"mode: {draw(st.sampled_from(['leader', 'central']))}", "hosts:"]
    lines += [f"  {name}: {{address: 10.0.0.{number + 1}}}" for number, name in enumerate(hosts)]
    lines += ["robots:", *(f"  {name}: {{type: khepera3, host: {host}}}" for name, host in robots.items())]
    lines += ["links:", f"  - {{kind: wlan, name: lab, hosts: [{', '.join(hosts)}]}}"]
    lines += [
        f"  - {{kind: serial, host: {host}, robot: {name}, usb: {{serial: S{name}}}}}"
        for name, host in robots.items()
    ]
    commanders = {name: draw(st.sampled_from([None, *hosts])) for name in robots}
    entries = [f"  - {{by: {by}, of: [{name}]}}" for name, by in commanders.items() if by is not None]
    lines += ["control:", *entries] if entries else []
    lines.insert(3, "leader: h0" if "leader" in lines[2] else "hub: h0")
    return "\n".join(lines) + "\n"


@settings(max_examples=60)
@given(text=swarms(), path=st.lists(st.sampled_from(list(Mode)), min_size=1, max_size=3))
def test_any_swarm_can_be_converted_through_any_modes(text: str, path: list[Mode]) -> None:
    document, _ = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None
    assume(not has_errors(lint(document)))
    for mode in path:
        before = set(document.spec.control)
        try:
            conversion = converted(document, mode)
        except ArrangementError:
            assert mode in (Mode.LEADER, Mode.SINGLE_MINDED)
            continue
        assert conversion.undone == ()
        document = document_of(conversion.text)
        assert before <= set(document.spec.control)
        assert infer(SwarmIndex(document)).mode is mode
