"""The baud rate of a serial link: supported by the robot type and by the host's port."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.links.serial_link import Serial
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.serial_lines.rules import BAUDS
from swarmctl.yamltext import edits


@rule("DEV007")
def agreed_rates(context: RuleContext) -> Iterator[Diagnostic]:
    """A baud rate that the robot type does not support. LINE004 reports non-standard rates."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.baud is None or link.baud not in BAUDS:
            continue
        type_name = context.spec.robots[link.robot].type
        known = context.bauds_of(link.robot)
        if known and link.baud not in known:
            rates = " or ".join(map(str, known))
            yield Diagnostic(
                "DEV007",
                f"robot `{link.robot}` (type `{type_name}`) supports {rates} baud, not {link.baud}",
                context.span("links", index, "baud"),
                label="both sides need the same rate",
                notes=(Note(context.span("robots", link.robot, "type"), "the robot's type"),),
                help=(f"leave `baud` out to use the type's rate, {known[0]}",),
                fix=edits.make_fix(
                    "remove `baud`",
                    edits.remove(context.document.source, ("links", index, "baud")),
                    safe=False,
                ),
            )
