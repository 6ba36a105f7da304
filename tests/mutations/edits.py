"""Edits of a spec by the places of its keys, for mistakes that need more than one value of one line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import SequenceMatcher
from functools import cache
from pathlib import Path
from string import Template

import yaml

from tests.mutations.defects import Change, Changes
from tests.mutations.places import File, Loc, Place

Edit = tuple[str, str | None]  # a dotted place and the text for it; None removes it


@cache
def facts(file: File) -> Mapping[str, str]:
    """Returns what templates may name: two hosts and their addresses, and two robots."""
    hosts = _names(
        file, ("leader", "hub", "islands.*.hub"), ("hosts.*",), ("robots.*.host", "programs.*.host")
    )
    robots = _names(file, (), ("robots.*",), ("control.*.of.*",))
    found = dict(zip(("host", "other"), hosts, strict=False))
    found |= zip(("robot", "robot2"), robots, strict=False)
    found |= {f"{name}_ns": found[name].replace("-", "_") for name in ("robot", "robot2") if name in found}
    for name, key in (("host", "address"), ("other", "address2")):
        for one in file.scalars(f"hosts.{found.get(name)}.address"):
            found[key] = str(one.value)
    return found


def _names(file: File, first: Sequence[str], keys: Sequence[str], then: Sequence[str]) -> list[str]:
    found = [
        *(str(one.value) for one in file.scalars(*first) if first),
        *(str(one.loc[-1]) for one in file.names(*keys)),
        *(str(one.value) for one in file.scalars(*then)),
    ]
    return [one for one in dict.fromkeys(found) if one.replace("-", "").isalnum()]


def ros_of(file: File) -> set[int]:
    """Returns the versions of ROS, 1 or 2, that the distributions named in the file are of."""
    islands = [one.value for one in file.scalars("islands.*.distro")]
    swarm = next((one.value for one in file.scalars("ros.distro")), "noetic")
    return {1 if one == "noetic" else 2 for one in [swarm, *islands]}


def listed(path: Path) -> dict[str, Changes]:
    """Returns the kinds of a file, each with its edits and with the `ros` that has it."""
    return {
        one["mistake"]: _changes([tuple(edit) for edit in one["edits"]], one.get("ros"))
        for one in yaml.safe_load(path.read_text("utf-8"))
    }


def _changes(edits: Sequence[Edit], ros: int | None) -> Changes:
    return lambda file: edited(file, *edits) if ros is None or ros_of(file) == {ros} else iter(())


def edited(file: File, *edits: Edit) -> Iterator[Change]:
    """Yields the change of all edits together; nothing where one of them has no place in the file."""
    try:
        filled = [tuple(text and Template(text).substitute(facts(file)) for text in edit) for edit in edits]
    except KeyError:
        return
    text: str | None = file.text
    for place, value in filled:
        text = text and _put(File(file.path, text), str(place).split("/"), value)
    if text is not None:
        what = ", ".join(str(place).replace("/", ".").replace("+", "") for place, _ in filled)
        yield Change(text, changed_lines(file.text, text), what)


def changed_lines(old: str, new: str) -> frozenset[int]:
    """Returns the lines of ``new`` that ``old`` does not have, and those beside a line that is gone."""
    same = SequenceMatcher(None, old.splitlines(), new.splitlines(), autojunk=False)
    return frozenset(
        line
        for kind, _, _, start, end in same.get_opcodes()
        if kind != "equal"
        for line in range(start + 1, max(end, start + 1) + 1)
    )


def _put(file: File, steps: Sequence[str], text: str | None) -> str | None:
    """Returns the file's text with ``text`` at a place. A step with `+` may be new, as may the last one."""
    at: dict[Loc, Place] = {tuple(map(str, one.loc)): one for one in file.values()}
    names = tuple(one.removeprefix("+") for one in steps)
    if text is None:
        found = at.get(names)
        return None if found is None else file.without(found.loc)
    if names in at:
        return file.with_text(at[names], text)
    known = next(length for length in range(len(names) - 1, -1, -1) if names[:length] in at)
    new = next((number for number, one in enumerate(steps) if one.startswith("+")), len(steps) - 1)
    if known < new or (known == 0 and ("version",) not in at):
        return None
    return _inserted(file, at[names[:known]], names[known:], text)


def _inserted(file: File, around: Place, names: Sequence[str], text: str) -> str:
    for name in reversed(names[1:]):
        text = f"[{text}]" if name == "*" else f"{{{name}: {text}}}"
    entry = f"- {text}" if names[0] == "*" else f"{names[0]}: {text}"
    if not around.loc:
        return f"{file.text.rstrip()}\n{entry}\n"
    if file.text[around.start] in "{[":
        inner = entry.removeprefix("- ")
        return f"{file.text[: around.start + 1]}{inner}, {file.text[around.start + 1 :]}"
    indent = around.start - file.text.rfind("\n", 0, around.start) - 1
    return f"{file.text[: around.start]}{entry}\n{' ' * indent}{file.text[around.start :]}"
