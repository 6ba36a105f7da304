"""Slips of an operator in the spec of a fleet: ``--fix`` makes it the fleet that is meant, or nothing.

Each row is a file of the example, a text of it and what the operator wrote instead.
"""

from __future__ import annotations

from functools import cache

import pytest

from swarmctl.diagnostics import has_errors
from swarmctl.linter.fixes import Findings, Texts, fixable
from swarmctl.spec.load import load
from swarmctl.spec.package_search import packages_in
from swarmctl.swarm.resolve import resolve
from tests import ROOT
from tests.loading import lint_files
from tests.rules.test_fixed_meaning import reader

FLEET = ROOT / "examples/lab-fleet"
SPEC = (FLEET / "swarm.yaml",)
search = cache(packages_in)

FIXED = [
    ("swarm", "groups:", "gruops:"),
    ("swarm", "include:", "includes:"),
    ("swarm", "mode: central", "mode: centrl"),
    ("swarm", "hub: desk", "hub: Desk"),
    ("swarm", 'of: ["@epucks"]', 'of: "@epucks"'),
    ("hosts", "hosts:\n", "host:\n"),
    ("hosts", "desk: {address:", "desk: {adress:"),
    ("hosts", "raspberry-pi-3b", "rasberry-pi-3b"),
    ("robots", "type: epuck2", "type: epuk2"),
    ("robots", "type: arduino-rover", "type: ArduinoRover"),
    ("robots", 'host: "p3-[01-10]", settings:', 'host: "p3-[01-10]", setings:'),
    ("robots", "{linear: 0.4}", '{linear: "0,4"}'),
    ("links", "kind: wlan", "kind: wifi"),
    ("programs", "executable: circle.py", "exectuable: circle.py"),
]
GUESSED = [
    ("swarm", 'of: ["@ground"]', 'of: ["@gruond"]'),
    ("swarm", '"type:turtlebot3-burger"', '"type:turtlebot3-burgr"'),
    ("swarm", '"!uav"', '"-uav"'),
    ("swarm", 'of: ["@turtles"]', "of: [turtles]"),
    ("swarm", '"p3-[06-10]"', '"p3-[10-06]"'),
    ("swarm", "by: circle-rovers", "by: circle-rover"),
    ("robots", 'host: "p3-[01-10]"', 'host: "p3-[01-10"'),
    ("programs", "needs: [gamepad]", "needs: [gampad]"),
    ("programs", "/cart/odom, type: nav_msgs", "/cart/odom, type: nav_msg"),
]
LEFT = [
    ("swarm", "  turtles:", "\tturtles:"),
    ("swarm", "of: [uav], priority", "of: [uav] priority"),
    ("swarm", '"tb3-[11-20]"', '"tb3-[11-30]"'),
    ("hosts", "  uav-pi:", "  uav-board:"),
    ("hosts", "192.168.77.171", "192.168.77.151"),
    ("hosts", "77.[101-120]", "77.[241-260]"),
    ("robots", "cart: {type: cart, host: desk}", "cart: {type: cart, host: tb3-01}"),
    ("robots", '"rover-pi-[1-6]"', '"rover-pi-[1-7]"'),
    ("robots", "{linear: 0.4}", "{linear: 400}"),
    ("robots", "{linear: 0.15}", "{linear: 0.15 m}"),
    ("links", "e8:c5:64:[01-12]", "e8:c5:[01-12]"),
    ("programs", "  circle-pioneers:", "   circle-pioneers:"),
]


@cache
def meant() -> object:
    return resolved({})


def resolved(texts: Texts) -> object:
    document, _ = load(SPEC, reader(texts))
    assert document is not None
    return resolve(document)


def after_fixes(slip: tuple[str, str, str]) -> tuple[object, object]:
    """The fleet after ``--fix``, and after ``--unsafe-fixes`` as well; None for a spec with errors."""
    name, right, wrong = slip
    file = str(FLEET / f"{name}.yaml")
    text = reader({})(FLEET / f"{name}.yaml").decode().replace(right, wrong, 1)

    def found_with(texts: Texts) -> Findings:
        return lint_files(SPEC, reader({file: text, **texts}), (), search)

    def fleet(texts: Texts) -> object:
        return None if has_errors(found_with(texts).diagnostics) else resolved({file: text, **texts})

    assert right in reader({})(FLEET / f"{name}.yaml").decode()
    assert fleet({}) is None
    found = fixable(found_with, lambda one: text if one == file else reader({})(FLEET / one).decode())
    return fleet(found.safe.texts), fleet(found.all.texts)


@pytest.mark.parametrize("slip", FIXED, ids=lambda slip: slip[2].strip())
def test_fix_makes_it_the_fleet_that_is_meant(slip: tuple[str, str, str]) -> None:
    assert after_fixes(slip)[0] == meant()


@pytest.mark.parametrize("slip", GUESSED, ids=lambda slip: slip[2].strip())
def test_a_guess_is_made_only_with_unsafe_fixes(slip: tuple[str, str, str]) -> None:
    safe, guessed = after_fixes(slip)
    assert safe is None
    assert guessed == meant()


@pytest.mark.parametrize("slip", LEFT, ids=lambda slip: slip[2].strip())
def test_what_cannot_be_known_stays_an_error(slip: tuple[str, str, str]) -> None:
    assert after_fixes(slip) == (None, None)
