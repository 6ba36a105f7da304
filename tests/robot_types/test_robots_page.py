"""docs/robots.md: its tables are made from the robot types, so that they always agree."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import rates_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.catalog import load_catalog
from swarmctl.swarm.topics import MESSAGES, actuators_of, topic_of
from tests import ROOT

PAGE = ROOT / "docs/robots.md"
ESTIMATES, END_OF_ESTIMATES = (
    "<!-- estimates, made by tests/robot_types/test_robots_page.py -->\n",
    "<!-- end of estimates -->\n",
)
BEGIN, END = "<!-- made by tests/robot_types/test_robots_page.py -->\n", "<!-- end -->\n"


def rows(name: str, kind: RobotType) -> Iterator[str]:
    rates = rates_of(kind, kind.settings)
    yield f"\n### {name}\n\n{kind.title}, {' or '.join(kind.link.kinds)}, {kind.link.baud} baud.\n"
    yield "\n| topic | message | default | what |\n|---|---|---|---|\n"
    for sensor, one in kind.sensors.items():
        rate = f"{rates[sensor]:g} Hz" if rates[sensor] else "off"
        yield f"| `{topic_of(sensor, one.kind)}` | {MESSAGES[one.kind]} | {rate} | {details(one)} |\n"
    for actuator, message in actuators_of(kind).items():
        one = kind.actuators[actuator]
        yield f"| `{actuator}` | {message}, subscribed | | {', '.join(one.channels)}: 0 to {one.max} |\n"


def details(sensor: object) -> str:
    names = getattr(sensor, "names", None) or [one.name for one in getattr(sensor, "elements", ())]
    unit = getattr(sensor, "unit", "")
    return ", ".join(names) + (f", {unit}" if unit else "")


def estimates(text: str) -> Iterator[str]:
    """The key and the clause of each comment of a type that says that something is an estimate.

    A comment on lines of its own belongs to the key that follows.
    """
    key, block = "", ""
    for line in text.splitlines():
        before, _, comment = line.partition("# ") if line.startswith("#") else line.partition(" # ")
        if comment and not before.strip():
            block = f"{block} {comment.strip()}".strip()
            continue
        key = named[0] if (named := re.findall(r"^ *([a-z_0-9]+):", before)) else key
        for text_of_comment in (block, comment.strip()):
            clauses = re.split(r"(?<=[.;]) ", text_of_comment)
            yield from (f"`{key}`: {_what(one)}" for one in clauses if "estimate" in one.lower())
        block = ""


def _what(clause: str) -> str:
    plain = re.sub("^an estimate: | is an estimate", "", clause.rstrip(".;"), flags=re.IGNORECASE)
    return plain[0].lower() + plain[1:]


def test_it_lists_all_that_is_estimated(golden: Callable[[Path, str], None]) -> None:
    """What a comment of a type calls an estimate stands on the page."""
    text = PAGE.read_text("utf-8")
    head, rest = text.split(ESTIMATES)
    files = sorted((ROOT / "templates/robots").glob("*.yaml"))
    found = [(file.stem, one) for file in files for one in estimates(file.read_text("utf-8"))]
    rows = "".join(f"| `{name}` | {one} |\n" for name, one in found)
    made = f"\n| type | what |\n|---|---|\n{rows}\n"
    golden(PAGE, f"{head}{ESTIMATES}{made}{END_OF_ESTIMATES}{rest.split(END_OF_ESTIMATES)[1]}")


def test_its_tables_match_the_types(golden: Callable[[Path, str], None]) -> None:
    text = PAGE.read_text("utf-8")
    head, rest = text.split(BEGIN)
    types = {name: one for name, one in with_protocol(load_catalog().types).items() if one.driver_protocol}
    made = "".join(row for name, one in sorted(types.items()) for row in rows(name, one))
    golden(PAGE, f"{head}{BEGIN}{made}\n{END}{rest.split(END)[1]}")


def test_every_robot_of_the_catalog_is_on_it() -> None:
    text = PAGE.read_text("utf-8")
    assert [name for name in load_catalog().types if f"`{name}`" not in text] == []
