"""Parameters of programs and drivers, as ROS 1 or ROS 2 reads them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.field_types import Parameter
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import PlaceholderError, filled
from swarmctl.ros_packages.parameters import ParameterFileError, Reader, read_file, reads_section, refusals
from swarmctl.rules.drivers import place_of_driver
from swarmctl.spec.program_model import Program


def reader_of(context: RuleContext) -> Reader:
    """Returns what reads the parameters of the nodes of one distribution."""
    return "rosparam" if context.has_masters else "rcl"


def _given(program: Program) -> dict[str, object]:
    """The parameters of its node that stand in the spec."""
    if program.executable is None:
        return {}
    return {name: value for name, value in program.params.items() if name not in program.file_params}


@rule("PARAM001", by_distro=True)
def values(context: RuleContext) -> Iterator[Diagnostic]:
    """A parameter that the node does not get as it is written."""
    reader = reader_of(context)
    for name, program in context.spec.programs.items():
        for refusal in refusals(_given(program), reader):
            yield Diagnostic(
                "PARAM001",
                f"{refusal.message} (a parameter of program `{name}`)",
                context.span("programs", name, "params", *refusal.loc),
                label=f"not for {reader}",
                help=(refusal.help,),
            )
    for name, driver in context.ros_drivers.items():
        for refusal in refusals(_filled(context, name, driver), reader):
            span = place_of_driver(context, name, "params", *refusal.loc)
            place = Note(context.span("robots", name, key=True), f"robot `{name}`")
            yield Diagnostic(
                "PARAM001",
                f"{refusal.message} (a parameter of the driver of robot `{name}`)",
                span,
                label=f"not for {reader}",
                notes=(place,) if span != place.span else (),
                help=(refusal.help,),
            )


def _filled(context: RuleContext, robot: str, driver: RosDriver) -> Mapping[str, Parameter]:
    """The parameters of a driver's node; none where DRIVER001 reports a placeholder."""
    with suppress(PlaceholderError):
        return filled(driver.params, context.placeholders_of(robot)) if driver.launch is None else {}
    return {}


@rule("PARAM003", by_distro=True)
def types_of_copies(context: RuleContext) -> Iterator[Diagnostic]:
    """A parameter of another type than another program with the same node gives it."""
    is_typed = reader_of(context) == "rcl"
    first: dict[tuple[str | None, str | None, str], tuple[str, object]] = {}
    for name, program in context.spec.programs.items():
        for key, value in _given(program).items() if program.package else ():
            other, given = first.setdefault((program.package, program.executable, key), (name, value))
            one, two = _type_of(given, is_typed=is_typed), _type_of(value, is_typed=is_typed)
            if one != two:
                yield Diagnostic(
                    "PARAM003",
                    f"`{key}` is {two} for program `{name}`, and {one} for `{other}`",
                    context.span("programs", name, "params", key),
                    label=f"both start `{program.executable}`",
                    notes=(Note(context.span("programs", other, "params", key), one),),
                    help=(f"write it in both as the node reads it: as {one}, or as {two}",),
                )


def _type_of(value: object, *, is_typed: bool) -> str:
    """The type that a node sees; a node of ROS 1 takes an integer for a double."""
    if isinstance(value, bool):
        return "a bool"
    if isinstance(value, int | float):
        return "a number" if not is_typed else "an integer" if isinstance(value, int) else "a double"
    return "a string" if isinstance(value, str) else "a mapping" if isinstance(value, dict) else "a list"


@rule("PARAM002", by_distro=True)
def unread_sections(context: RuleContext) -> Iterator[Diagnostic]:
    """Sections of a file of ROS 2 that no node of the programs with this file reads."""
    if reader_of(context) == "rosparam":
        return
    readers: dict[str, list[str]] = {}  # the programs with each file
    for name, program in context.spec.programs.items():
        for path in program.file_params.values():
            readers.setdefault(path, []).append(name)
    for path, programs in readers.items():
        sections = _sections(context.document.files.content.get(path))
        nodes = {context.program_nodes[one]: one for one in programs}
        unread = [one for one in sections if not any(reads_section(one, node) for node in nodes)]
        if unread:
            first = programs[0]
            key = next(key for key, one in context.spec.programs[first].file_params.items() if one == path)
            yield Diagnostic(
                "PARAM002",
                f"no node reads {_listed(unread)} of {path}",
                context.span("programs", first, "params", key, "file"),
                label=f"its node is {_listed(nodes)}" if len(nodes) == 1 else f"for {_listed(nodes)}",
                help=("give the section the name of the node, or `/**`, which all read",),
            )


def _sections(content: bytes | None) -> tuple[str, ...]:
    """The nodes that a file of ROS 2 is for; none of a file that PROG028 or PROG029 reports."""
    try:
        return tuple(read_file(content, "rcl").nodes) if content is not None else ()
    except ParameterFileError:
        return ()


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{one}`" for one in names)
