"""A spec rewritten into another mode: its text changed where the arrangement asks for it, nowhere else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.spec import edits
from swarmctl.spec.edits import Edits
from swarmctl.spec.load import Document
from swarmctl.spec.model import Bluetooth, Mode, Spec
from swarmctl.spec.source import Loc, Source, parse
from swarmctl.topology.arrange import Arrangement, arranged, moved_lines
from swarmctl.topology.modes import MULTIMASTER, ROLES


@dataclass(frozen=True)
class Conversion:
    """The new text, what was changed in it, what is left to do with hands, and what could not be changed."""

    text: str
    changes: tuple[str, ...]
    by_hand: tuple[str, ...]
    undone: tuple[str, ...]


def converted(document: Document, mode: Mode) -> Conversion:
    """``document`` in ``mode``. Raises ArrangementError where the swarm lacks the hosts for it."""
    spec = document.spec
    plan = arranged(spec, mode)
    paper = _Paper(document.source)
    _mode_and_roles(paper, spec, plan)
    _islands(paper, spec, plan)
    _placement(paper, spec, plan)
    _control(paper, spec, plan)
    _clock(paper, document, plan)
    return Conversion(paper.source.text, tuple(paper.done), tuple(_by_hand(spec, plan)), tuple(paper.undone))


class _Paper:
    """The text under change, read anew after every change, so that each one sees those before it."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.done: list[str] = []
        self.undone: list[str] = []

    def change(self, title: str, make: Callable[[Source], Edits]) -> None:
        made = make(self.source)
        if {edit.span.file for edit in made} != {self.source.path}:  # none, or what another file says
            self.undone.append(title)
            return
        self.source, _ = parse(edits.apply(self.source.text, made), self.source.path)
        self.done.append(title)

    def replace(self, loc: Loc, value: Any) -> None:
        self.change(f"{_path(loc)}: {_shown(value)}", lambda now: edits.replace_value(now, loc, value))

    def set(self, loc: Loc, key: str, value: Any, after: str = "") -> None:
        title = f"{_path((*loc, key))}: {_shown(value)}"
        self.change(title, lambda now: edits.set_key(now, loc, key, value, after=after))

    def remove(self, loc: Loc) -> None:
        self.change(f"{_path(loc)} is gone", lambda now: edits.remove(now, loc))

    def rename(self, loc: Loc, key: str) -> None:
        self.change(f"{_path(loc)} is called {key}", lambda now: edits.rename_key(now, loc, key))

    def append(self, loc: Loc, value: Any) -> None:
        self.change(f"{_path(loc)} has {_shown(value)}", lambda now: edits.append_item(now, loc, value))


def _mode_and_roles(paper: _Paper, spec: Spec, plan: Arrangement) -> None:
    if spec.mode is not plan.mode:
        paper.replace(("mode",), plan.mode.value)
    role = ROLES.get(plan.mode)
    wanted = role.key if role else None
    present = [key for key in ("leader", "hub") if getattr(spec, key) is not None]
    for key in present:
        if key != wanted and wanted is not None and wanted not in present:
            paper.rename((key,), wanted)
            if getattr(spec, key) != plan.hub:
                paper.replace((wanted,), plan.hub)
            return
        if key != wanted:
            paper.remove((key,))
    if wanted is None:
        return
    if wanted not in present:
        paper.set((), wanted, plan.hub, after="mode")
    elif getattr(spec, wanted) != plan.hub:
        paper.replace((wanted,), plan.hub)


def _islands(paper: _Paper, spec: Spec, plan: Arrangement) -> None:
    if plan.islands and len(spec.islands) < 2:
        paper.set((), "islands", _plain(plan.islands))
    elif spec.islands and not plan.islands:
        paper.remove(("islands",))
    if spec.multimaster is not None and plan.mode not in MULTIMASTER:
        paper.remove(("multimaster",))


def _placement(paper: _Paper, spec: Spec, plan: Arrangement) -> None:
    """Lines, drivers and programs move to where the mode wants them."""
    for index, link, home in moved_lines(spec, plan):
        paper.replace(("links", index, "host"), home)
        if not isinstance(link, Bluetooth):
            continue
        radios = spec.hosts[home].bluetooth
        if not radios and ("bluetooth" not in (paper.source.data["hosts"][home] or {})):
            paper.set(("hosts", home), "bluetooth", ["hci0"])
        if link.adapter is not None and link.adapter not in (radios or ("hci0",)):
            paper.remove(("links", index, "adapter"))
    for name, robot in spec.robots.items():
        home = plan.homes.get(name, plan.hub)
        if robot.host is None and plan.mode is not Mode.SINGLE_MINDED:
            paper.set(("robots", name), "host", home)
        elif robot.host is not None and robot.host != home:
            paper.replace(("robots", name, "host"), home)
    for name, host in plan.programs.items():
        if spec.programs[name].host != host:
            paper.replace(("programs", name, "host"), host)


def _control(paper: _Paper, spec: Spec, plan: Arrangement) -> None:
    kept = {order.index: order for order in plan.orders if order.index is not None}
    new = [{"by": order.by, "of": list(order.of)} for order in plan.orders if order.index is None]
    if spec.control and not kept:
        if new:
            paper.replace(("control",), new)
        else:
            paper.remove(("control",))
        return
    for index in reversed(range(len(spec.control))):
        if index not in kept:
            paper.remove(("control", index))
        elif kept[index].of != spec.control[index].of:
            paper.replace(("control", index, "of"), list(kept[index].of))
    if new and not spec.control:
        paper.set((), "control", new)
    else:
        for order in new:
            paper.append(("control",), order)


def _clock(paper: _Paper, document: Document, plan: Arrangement) -> None:
    """Where several masters meet no hub lends its clock by itself."""
    spec = document.spec
    kinds = {host.computer or spec.defaults.host.computer for host in spec.hosts.values()}
    without = any(kind in document.computers and not document.computers[kind].clock for kind in kinds if kind)
    if plan.mode not in MULTIMASTER or spec.time.root is not None or not without:
        return
    if "time" in spec.model_fields_set:
        paper.set(("time",), "root", plan.hub)
    else:
        paper.set((), "time", {"root": plan.hub})


def _by_hand(spec: Spec, plan: Arrangement) -> list[str]:
    """What the text cannot do: cables to move, robots to pair."""
    return [
        f"pair `{link.robot}` with a Bluetooth adapter of `{home}`"
        if isinstance(link, Bluetooth)
        else f"plug the line of `{link.robot}` into `{home}` instead of `{link.host}`"
        for _, link, home in moved_lines(spec, plan)
    ]


def _path(loc: Loc) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc).lstrip(".")


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_shown(one)}" for key, one in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_shown, value)) + "]"
    return str(value)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, (list, tuple)) else value
