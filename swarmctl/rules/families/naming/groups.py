"""Groups and labels have names of their own."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.rules.context import RuleContext, rule
from swarmctl.yamltext.source import Loc


@rule("NAME011")
def names_of_sets(context: RuleContext) -> Iterator[Diagnostic]:
    """A label or group with the name of a host or robot, or a label with the name of a group."""
    spec = context.spec
    places: dict[str, tuple[Loc, str]] = {name: (("groups", name), "group") for name in spec.groups}
    for section, entries in (("hosts", spec.hosts), ("robots", spec.robots)):
        for name, entry in entries.items():
            for number, label in enumerate(entry.labels):
                place: Loc = (section, name, "labels", number)
                if places.setdefault(label, (place, "label"))[1] == "group":
                    yield Diagnostic(
                        "NAME011",
                        f"`{label}` is a label and a group: `@{label}` selects what has either",
                        context.span(*place),
                        notes=(Note(context.span("groups", label, key=True), "the group"),),
                        help=("rename one of the two",),
                    )
    for name, (place, what) in places.items():
        section = next((one for one in ("hosts", "robots") if name in getattr(spec, one)), "")
        if section:
            kind = section.removesuffix("s")
            yield Diagnostic(
                "NAME011",
                f"`{name}` is a {what} and a {kind}: `@{name}` selects another set than `{name}`",
                context.span(*place, key=what == "group"),
                notes=(Note(context.span(section, name, key=True), f"the {kind}"),),
                help=(f"rename the {what}",),
            )
