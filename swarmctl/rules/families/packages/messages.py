"""The message definitions of packages: genmsg accepts them, and all copies are equal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from swarmctl.diagnostics import Diagnostic
from swarmctl.ros_packages.message_catalog import common_messages
from swarmctl.ros_packages.message_definitions import checksums
from swarmctl.ros_packages.package import Package
from swarmctl.rules.context import RuleContext, rule
from swarmctl.yamltext.source import Loc


@rule("PKG014", ros1=True)
def copies(context: RuleContext) -> Iterator[Diagnostic]:
    """Two definitions of one message that differ: nodes built with them do not connect."""
    if not context.document.packages.found:
        return  # to read the catalog takes longer than all other rules on a small spec
    common = common_messages().sums
    first: dict[str, tuple[str, str]] = {kind: (value, "the one of Noetic") for kind, value in common.items()}
    places = _places(context)
    for package in context.document.packages.found:
        definitions, _ = package.definitions
        differing: dict[str, list[str]] = {}
        for kind, value in checksums(definitions, {**context.messages.sums, **common}).items():
            other, where = first.setdefault(kind, (value, f"the one in {package.folder}"))
            if other != value:
                differing.setdefault(where, []).append(kind)
        for where, kinds in differing.items():
            if (loc := _place(places, package, kinds[0])) is None:
                continue
            more = f" and {len(kinds) - 1} more" if len(kinds) > 1 else ""
            yield Diagnostic(
                "PKG014",
                f"the definition of `{kinds[0]}`{more} in {package.folder} differs from {where}",
                context.span(*loc),
                label="its nodes do not connect with the others",
                help=("keep one copy, and build all hosts with it",),
            )


def _places(context: RuleContext) -> Mapping[str, Loc]:
    """Where the spec names a message type first, or else a package."""
    found: dict[str, Loc] = {}
    for one in context.endpoints if context.document.packages.found else ():
        if one.loc[2:]:
            found.setdefault(one.type, (*one.loc, "type"))
            found.setdefault(one.type.partition("/")[0], (*one.loc, "type"))
    for name, program in context.spec.programs.items():
        if program.package is not None:
            found.setdefault(program.package, ("programs", name, "package"))
    return found


def _place(places: Mapping[str, Loc], package: Package, kind: str = "") -> Loc | None:
    """Where the spec uses the message or its package; None for a package that only lies there."""
    return places.get(kind) or places.get(package.name)
