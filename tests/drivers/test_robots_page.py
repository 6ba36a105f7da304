"""docs/robots.md: its tables are made from the robot types, so that they cannot say anything else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.robot_type import RobotType, rates_of
from swarmctl.topology.interfaces import MESSAGES, actuators_of

PAGE = Path(__file__).parents[2] / "docs/robots.md"
BEGIN, END = "<!-- made by tests/drivers/test_robots_page.py -->\n", "<!-- end -->\n"


def rows(name: str, kind: RobotType) -> Iterator[str]:
    rates = rates_of(kind, kind.settings)
    yield f"\n### {name}\n\n{kind.title}, {' or '.join(kind.link.kinds)}, {kind.link.baud} baud.\n"
    yield "\n| topic | message | default | what |\n|---|---|---|---|\n"
    for sensor, one in kind.sensors.items():
        rate = f"{rates[sensor]:g} Hz" if rates[sensor] else "off"
        yield f"| `{sensor}` | {MESSAGES[one.kind]} | {rate} | {told(one)} |\n"
    for actuator, message in actuators_of(kind).items():
        one = kind.actuators[actuator]
        yield f"| `{actuator}` | {message}, heard | | {', '.join(one.channels)}: 0 to {one.max} |\n"


def told(sensor: object) -> str:
    names = getattr(sensor, "names", None) or [one.name for one in getattr(sensor, "elements", ())]
    unit = getattr(sensor, "unit", "")
    return ", ".join(names) + (f", {unit}" if unit else "")


def test_its_tables_are_what_the_types_say(golden: Callable[[Path, str], None]) -> None:
    text = PAGE.read_text("utf-8")
    head, rest = text.split(BEGIN)
    types = {name: one for name, one in load_catalog().types.items() if one.asked}
    made = "".join(row for name, one in sorted(types.items()) for row in rows(name, one))
    golden(PAGE, f"{head}{BEGIN}{made}\n{END}{rest.split(END)[1]}")


def test_every_robot_of_the_catalog_is_on_it() -> None:
    text = PAGE.read_text("utf-8")
    assert [name for name in load_catalog().types if f"`{name}`" not in text] == []
