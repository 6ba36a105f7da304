"""What the shell offers for an argument: robots and hosts of the spec, robot types, modes, rule ids.

A wrong spec offers nothing, and no message disturbs the line that is being typed.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from swarmctl.cli import spec_args

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.spec.load import Document
    from swarmctl.spec.model import Spec

Offer = Callable[[typer.Context, str], list[str]]


def robots(context: typer.Context, incomplete: str) -> list[str]:
    """The robots of the spec."""
    return _beginning(incomplete, lambda: _spec(context).robots)


def hosts(context: typer.Context, incomplete: str) -> list[str]:
    """The hosts of the spec."""
    return _beginning(incomplete, lambda: _spec(context).hosts)


def selections(context: typer.Context, incomplete: str) -> list[str]:
    """What can end a selection: hosts, robots, groups and labels, islands, types."""
    from swarmctl.spec.selection import words_for
    from swarmctl.spec.selection_expansion import candidates_in

    last = re.split("[,&!(]", incomplete)[-1]
    begun = incomplete.removesuffix(last)
    words = _beginning(last, lambda: words_for(candidates_in(_document(context).source.root), last))
    return [f"{begun}{one}" for one in words]


def hosts_and_operator(context: typer.Context, incomplete: str) -> list[str]:
    """The hosts of the spec, and the operator's place in a lab."""
    return _beginning(incomplete, lambda: [*_spec(context).hosts, "operator"])


def hosts_and_robots(context: typer.Context, incomplete: str) -> list[str]:
    """The hosts and the robots of the spec."""
    return _beginning(incomplete, lambda: [*_spec(context).hosts, *_spec(context).robots])


def named(context: typer.Context, incomplete: str) -> list[str]:
    """The hosts, robots, programs and groups of the spec."""

    def known() -> Iterable[str]:
        spec = _spec(context)
        return dict.fromkeys((*spec.hosts, *spec.robots, *spec.programs, *spec.groups))

    return _beginning(incomplete, known)


def types(context: typer.Context, incomplete: str) -> list[str]:
    """The robot types that swarmctl ships and those beside the spec."""
    from swarmctl.spec.catalog import load_catalog

    folder = Path(context.params.get("folder") or "")
    return _beginning(incomplete, lambda: sorted(load_catalog(folder / "robots").types))


def emulators(context: typer.Context, incomplete: str) -> list[str]:
    """The robot types that have an emulator."""
    from swarmctl.lab.emulators import TYPES

    return _beginning(incomplete, lambda: TYPES)


def modes(context: typer.Context, incomplete: str) -> list[str]:
    """The modes of a swarm."""
    from swarmctl.spec.model import Mode

    return _beginning(incomplete, lambda: [one.value for one in Mode])


def rule_ids(context: typer.Context, incomplete: str) -> list[str]:
    """The ids of all rules."""
    from swarmctl.rulebook import rulebook

    return _beginning(incomplete.upper(), rulebook)


def _spec(context: typer.Context) -> Spec:
    """The spec that the line names, or the one in the current folder. Raises ValueError without one."""
    return _document(context).spec


def _document(context: typer.Context) -> Document:
    from swarmctl.spec.load import load

    files: SpecFiles | None = context.params.get("spec") or spec_args.usual()
    document = load(files.files)[0] if files else None
    if document is None:
        raise ValueError
    return document


def _beginning(incomplete: str, known: Callable[[], Iterable[str]]) -> list[str]:
    try:
        return [one for one in known() if one.startswith(incomplete)]
    except (OSError, ValueError):
        return []
