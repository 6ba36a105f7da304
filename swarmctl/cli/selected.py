"""The hosts and robots that options and arguments select, with a note on hosts that stand for robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from swarmctl.cli import console

if TYPE_CHECKING:
    from swarmctl.spec.selection import Selected
    from swarmctl.spec.selection_candidates import Candidates, Kind

_SHOWN = 3  # hosts in a note


def hosts(known: Candidates, selections: Sequence[str] | None, option: str = "--limit") -> list[str]:
    """The selected hosts in the order of the spec, all without a selection; exits with an error for none.

    Prints on stderr which hosts stand for robots.
    """
    if not selections:
        return list(known.hosts)
    found = _selected(known, selections, "hosts", option)
    if found.through:
        console.show(f"note: {option} selects hosts: {_through(known, found)}", error=True)
    return list(found.names)


def robots(known: Candidates, selections: Sequence[str], option: str) -> list[str]:
    """The selected robots in the order of the spec, all without a selection; exits with an error for none."""
    return list(_selected(known, selections, "robots", option).names) if selections else list(known.robots)


def hosts_and_robots(
    known: Candidates, selections: Sequence[str], option: str
) -> tuple[list[str], list[str]]:
    """The selected hosts, and the selected robots together with those of these hosts; exits without any."""
    found = _selected(known, selections, "hosts", option)
    direct = [one for one in found.names if one not in found.through]
    meant = {name for names in found.through.values() for name in names}
    return direct, [name for name, one in known.robots.items() if name in meant or one.host in direct]


def parts(known: Candidates, selections: Sequence[str] | None, option: str) -> dict[str, list[str]]:
    """By selected host, the robots and programs that are meant there; none where the whole host is meant.

    A program is named alone, as ``map`` or ``program:map``. Exits with an error for none.
    """
    if not selections:
        return {host: [] for host in known.hosts}
    named = {one: one.removeprefix("program:") for one in selections}
    programs = [
        name for one, name in named.items() if name in known.programs and one not in known.hosts_and_robots
    ]
    others = [one for one in selections if named[one] not in programs]
    found = _selected(known, others, "hosts", option) if others else None
    meant = {host: list(found.through.get(host, ())) for host in found.names} if found else {}
    whole = {host for host, robots in meant.items() if not robots}
    for name in programs:
        host = known.host_of_program(name)
        if host is None:
            console.fail(f"{option}: program `{name}` runs on no host")
        if host not in whole:
            meant.setdefault(host, []).append(name)
    return {host: meant[host] for host in known.hosts if host in meant}


def one(known: Candidates, selection: str, kind: Kind, option: str) -> str:
    """The one host or robot that is selected; exits with an error that names all for several."""
    from swarmctl.yamltext import hostlist

    names = list(_selected(known, [selection], kind, option).names)
    if len(names) > 1:
        console.fail(
            f"{option}: `{selection}` selects {len(names)} {kind}, and one is needed",
            f"name one of {hostlist.written(names)}",
        )
    if names[0] != selection.removeprefix(f"{kind[:-1]}:"):
        console.err().print(f"note: {option} selects {names[0]}")
    return names[0]


def _selected(known: Candidates, selections: Sequence[str], kind: Kind, option: str) -> Selected:
    from swarmctl.spec.selection import select
    from swarmctl.yamltext.selection_text import SelectionError

    try:
        return select(selections, known, kind)
    except SelectionError as error:
        text = selections[error.number]
        part = text[error.start : error.end]
        place = f" `{text}`, column {error.start + 1}" if part != text and not error.inside else ""
        console.fail(f"{option}{place}: {error.message}", *error.help_lines)


def _through(known: Candidates, found: Selected) -> str:
    """Such as ``pi-1 for ep-1 (and drives ep-2 too), pi-2 for ep-3``."""
    from swarmctl.yamltext import hostlist

    shown = []
    for host, meant in list(found.through.items())[:_SHOWN]:
        others = [name for name, one in known.robots.items() if one.host == host and name not in meant]
        too = f" ({host} drives {hostlist.written(others)} too)" if others else ""
        shown.append(f"{host} for {hostlist.written(meant)}{too}")
    more = len(found.through) - len(shown)
    return ", ".join(shown) + (f", and {more} more" if more else "")
