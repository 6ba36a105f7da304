"""The scripts of delivered packages name an interpreter that hosts have."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.ros_packages.package import DeliveredPackage
from swarmctl.rules.context import RuleContext, rule

_FIRST_LINE = re.compile(rb"#![ \t]*(?:\S*/env[ \t]+(?:-\S+[ \t]+)*)?(\S+)[^\n]*")
_PYTHON_2 = re.compile(r"(?:\S*/)?python(?:2(?:\.\d+)?)?")
_MOST_NAMED = 3


@rule("PKG021", ros1=True)
def interpreters(context: RuleContext) -> Iterator[Diagnostic]:
    """Scripts of a delivered package whose first line names an interpreter that a host of noetic lacks."""
    for name, package in context.document.packages.delivered.items():
        found = dict(_unknown(package))
        if not found:
            continue
        path, interpreter = next(iter(found.items()))
        named = ", ".join(f"`{one}`" for one in list(found)[:_MOST_NAMED])
        more = f" and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
        several = len(found) > 1
        yield Diagnostic(
            "PKG021",
            f"{named}{more} of package `{name}` name{'' if several else 's'} the "
            f"interpreter `{interpreter}`, which hosts do not have",
            context.span("packages", package.entry or name, "from"),
            label="systemd would start it again and again",
            help=(
                f"save `{path}` with line ends of Unix"
                if interpreter.endswith("\\r")
                else f"write `#!/usr/bin/env python3` as the first line of `{path}`",
            ),
        )


def _unknown(package: DeliveredPackage) -> Iterator[tuple[str, str]]:
    """Yields the path of each such script, with its interpreter."""
    for path, (content, executable) in package.files.items():
        line = _FIRST_LINE.match(content) if executable else None
        if line is None:
            continue
        interpreter = line[1].decode("utf-8", "replace")
        if line[0].endswith(b"\r"):
            yield path, f"{interpreter}\\r"
        elif _PYTHON_2.fullmatch(interpreter):
            yield path, interpreter
