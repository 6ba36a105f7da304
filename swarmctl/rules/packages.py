"""ROS packages beside the spec: executables, messages, delivery, and the names that their nodes get."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from swarmctl.diagnostics import Diagnostic, Fix, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.linter.launch_uses import declared_launches
from swarmctl.plugins import MIDDLEWARES
from swarmctl.ros_packages.builds import with_dependencies
from swarmctl.ros_packages.launch_files import Place
from swarmctl.ros_packages.message_catalog import common_messages
from swarmctl.ros_packages.message_definitions import checksums
from swarmctl.ros_packages.package import Package
from swarmctl.suggest import Guess, did_you_mean, guess, nearest
from swarmctl.swarm.command_topics import COMMAND
from swarmctl.swarm.names import resolved
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc

_UBUNTU = {  # REP 3 and REP 2000
    **dict.fromkeys(("kinetic", "lunar"), "16.04"),
    **dict.fromkeys(("melodic", "crystal", "dashing", "eloquent"), "18.04"),
    **dict.fromkeys(("noetic", "foxy", "galactic"), "20.04"),
    **dict.fromkeys(("humble", "iron"), "22.04"),
    **dict.fromkeys(("jazzy", "kilted"), "24.04"),
}


@rule("PKG001", "PKG002", needs="catkin")
def executables(context: RuleContext) -> Iterator[Diagnostic]:
    """An executable that its package does not have, or that may not be executed."""
    for name, program in context.spec.programs.items():
        package = context.document.packages.by_name.get(program.package or "")
        if package is None:
            continue
        if program.executable is not None:
            loc = ("programs", name, "executable")
            yield from _executable(context, loc, package, program.executable, f"program `{name}`")
    seen: set[tuple[Span, Place]] = set()
    for use in context.launches:
        span = context.launch_span(use, "launch")
        for node in use.launched.nodes:
            of_node = context.document.packages.by_name.get(node.package or "")
            if of_node is not None and node.executable and node.certain and (span, node.place) not in seen:
                seen.add((span, node.place))
                yield from _executable(context, span, of_node, node.executable, f"{node.place}")


def _executable(
    context: RuleContext, at: Loc | Span, package: Package, name: str, who: str
) -> Iterator[Diagnostic]:
    span = at if isinstance(at, Span) else context.span(*at)
    found = package.executable(name)
    if found is None and not package.is_computed:
        meant = guess(name, package.executables)
        yield Diagnostic(
            "PKG001",
            f"package `{package.name}` ({package.folder}) has no executable `{name}`, which {who} starts",
            span,
            label="not found in the package",
            help=did_you_mean(name, package.executables, f"executables of {package.name}"),
            fix=None if isinstance(at, Span) else _write(context, at, meant),
        )
    elif found is False:
        path = next(one for one in package.files if posixpath.basename(one) == name)
        yield Diagnostic(
            "PKG002",
            f"`{path}` of package `{package.name}` is not executable, and {who} starts it",
            span,
            label="roslaunch does not find it",
            help=(
                f"run `chmod +x {posixpath.join(package.folder, path)}`",
                "or install it in CMakeLists.txt by `catkin_install_python(PROGRAMS ...)`",
            ),
        )


_SOURCE = (".c", ".cc", ".cpp", ".cxx", ".h", ".hpp")


@rule("PKG027")
def source_code(context: RuleContext) -> Iterator[Diagnostic]:
    """A file of source code where the executable belongs that is built from it."""
    for name, program in context.spec.programs.items():
        stem, dot, ending = (program.executable or "").rpartition(".")
        if f"{dot}{ending}" in _SOURCE and program.package not in context.document.packages.by_name:
            loc = ("programs", name, "executable")
            yield Diagnostic(
                "PKG027",
                f"program `{name}` starts `{program.executable}`, which is source code",
                context.span(*loc),
                label="not what is built from it",
                help=(f"write the name of its `add_executable` in CMakeLists.txt, such as `{stem}`",),
                fix=_write(context, loc, Guess((stem,), certain=False)),
            )


@rule("PKG003", needs="launch-xml")
def launch_files(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file that its package does not have."""
    packages, seen = context.document.packages.by_name, set()
    for use, _ in declared_launches(context) if packages else ():
        package, path = packages.get(use.started.package or ""), use.started.launch or ""
        span = context.launch_span(use, "launch")
        if package is None or f"launch/{path}" in package.files or span in seen:
            continue
        seen.add(span)
        base = posixpath.basename(path)
        elsewhere = [one for one in package.files if posixpath.basename(one) == base]
        meant = guess(path, package.launch_paths())
        yield Diagnostic(
            "PKG003",
            f"package `{package.name}` ({package.folder}) has no launch file `launch/{path}`",
            span,
            label="not found in the package",
            help=(f"move `{elsewhere[0]}` into the folder `launch` of the package",)
            if elsewhere and not meant.words
            else did_you_mean(path, package.launch_paths(), f"launch files of {package.name}"),
            fix=None if use.of_type else _write(context, (*use.loc, "launch"), meant),
        )


@rule("PKG016", needs="catkin")
def misspelt(context: RuleContext) -> Iterator[Diagnostic]:
    """A package that is nowhere, and named like one that is found but for a typing error."""
    found = context.document.packages.by_name
    for loc, name in _named(context) if found else ():
        meant = guess(name, found)
        if name not in found and name not in context.messages.packages and meant.certain:
            near = found[meant.words[0]]
            yield Diagnostic(
                "PKG016",
                f"package `{name}` is not beside the spec, but `{near.name}` is ({near.folder})",
                context.span(*loc),
                label="probably misspelt",
                help=did_you_mean(name, found, "packages"),
                fix=_write(context, loc, replace(meant, certain=False)),  # a host may have a package so named
            )


def _named(context: RuleContext) -> Iterator[tuple[Loc, str]]:
    for name, program in context.spec.programs.items():
        if program.package is not None:
            yield ("programs", name, "package"), program.package
        for index, one in enumerate(program.requires):
            yield ("programs", name, "requires", index), one


@rule("PKG024")
def debian_names(context: RuleContext) -> Iterator[Diagnostic]:
    """A Debian package where the name of a ROS package belongs."""
    for loc, name in _named(context):
        head, _, rest = name.partition("-")
        distro, _, own = rest.partition("-")
        of_ros = head == "ros" and distro in MIDDLEWARES and bool(own)
        if (of_ros or head == "python3") and rest and name not in context.document.packages.by_name:
            meant = own.replace("-", "_")
            yield Diagnostic(
                "PKG024",
                f"`{name}` is a Debian package, not a ROS package",
                context.span(*loc),
                label="as apt names it",
                help=(f"write `{meant}`",)
                if of_ros
                else (f"write `install: {{apt: [{name}]}}` at the program, which `prepare` then installs",),
                fix=make_fix(f"write `{meant}`", replace_value(context.source, loc, meant), safe=meant == own)
                if of_ros
                else None,
            )


@rule("PKG025")
def other_releases(context: RuleContext) -> Iterator[Diagnostic]:
    """A Debian package of a ROS distribution that the host's release of Ubuntu does not have."""
    installs = [
        *((("hosts", name), name, host.install) for name, host in context.spec.hosts.items()),
        *(
            (("programs", name), context.program_hosts[name], one.install)
            for name, one in context.spec.programs.items()
        ),
    ]
    for loc, host, install in installs:
        for index, package in enumerate(install.apt if install else ()):
            distro, own = package.removeprefix("ros-").partition("-")[0], context.distro_of_host(host)
            release = _UBUNTU.get(distro) if package.startswith("ros-") else None
            if release is not None and release != _UBUNTU.get(own, release):
                meant = package.replace(distro, own, 1)
                yield Diagnostic(
                    "PKG025",
                    f"`{package}` is for Ubuntu {release}, and `{own}` for {_UBUNTU[own]}",
                    context.span(*loc, "install", "apt", index),
                    label=f"of ROS {distro}",
                    help=(f"did you mean `{meant}`?",),
                    fix=_write(context, (*loc, "install", "apt", index), Guess((meant,), certain=False)),
                )


def _write(context: RuleContext, loc: Loc, meant: Guess) -> Fix | None:
    if meant.only is None:
        return None
    edits = replace_value(context.source, loc, meant.only)
    return make_fix(f"write `{meant.only}`", edits, safe=meant.certain)


@rule("PKG017", needs="catkin")
def delivered_packages(context: RuleContext) -> Iterator[Diagnostic]:
    """A package under `packages` that cannot travel with a release."""
    for name, reason in context.document.packages.refused.items():
        source = context.spec.packages[name]
        if "catkin refuses" in reason:
            help_ = "correct the file: where catkin refuses one package, `rosrun` and `roslaunch` find none"
        elif source.all:
            help_ = "every folder with a package.xml in it is delivered; docs/hosts.md has the limits"
        elif "package.xml" in reason:
            help_ = f"name the folder of {name} alone; for a folder of several packages add `all: true`"
        else:
            help_ = f"name the folder in which the package.xml of {name} lies"
        yield Diagnostic(
            "PKG017",
            f"`{source.folder}` {reason}",
            context.span("packages", name, "from"),
            help=(help_,),
        )


@rule("PKG018", needs="catkin")
def unbuildable(context: RuleContext) -> Iterator[Diagnostic]:
    """A package that has to be built, in a spec that names no builder."""
    if context.spec.ros.builders:
        return
    first = next(iter(context.spec.hosts))
    delivered = context.document.packages.delivered
    drivers = (driver.packages for driver in context.ros_drivers.values())
    programs = ((one.package or "", *one.requires) for one in context.spec.programs.values())
    used = with_dependencies((name for names in (*drivers, *programs) for name in names), delivered)
    of_workspaces = {one.name for one in used}
    for name, package in delivered.items():
        if package.built_by and (not package.entry or name in of_workspaces):
            yield Diagnostic(
                "PKG018",
                f"`{name}` has to be built ({package.built_by} in its CMakeLists.txt), and no host builds",
                context.span("packages", package.entry or name, key=True),
                help=(f"name a host that builds for those of its kind: ros: {{builders: [{first}]}}",),
            )


@rule("PKG014", needs="catkin")
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


_FRAME = re.compile(r"(^|.*[_/])frame(_id)?", re.I)
_OF_DRIVERS = ("base_link", "odom")  # every robot has these, behind its name
_PUBLISHERS = {"robot_state_publisher", "static_transform_publisher", "state_publisher"}


@rule("PKG012", needs="ros1-nodes")
def remapped_topics(context: RuleContext) -> Iterator[Diagnostic]:
    """A name is remapped to a topic of a robot that does not exist."""
    known = {one.topic for one in context.endpoints}
    for span, topic, where in _remaps(context):
        space, name = context.split_topic(topic)
        if topic in known or space in context.robot_by_namespace:
            continue
        near = nearest(space, tuple(context.robot_by_namespace)) if space else None
        if topic == f"/{COMMAND}" or (near is not None and name in _topics_of(context, near)):
            meant = f"{near}/{name}" if near else None
            yield Diagnostic(
                "PKG012",
                f"no robot has the topic `{topic}`{where}",
                span,
                label="remapped to nobody's topic",
                help=(f"did you mean `{meant}`?",)
                if meant
                else (f"remap to `{next(iter(context.robot_by_namespace))}/{name}`, or whose it is",),
            )


def _remaps(context: RuleContext) -> Iterator[tuple[Span, str, str]]:
    for name, program in context.spec.programs.items():
        node = context.program_nodes[name]
        for old, new in program.remap.items():
            yield context.span("programs", name, "remap", old), resolved(new, node, {}), ""
    for use in (one for one in context.launches if not one.is_driver):  # TOPIC011 and PKG022 have theirs
        span = context.launch_span(use, "launch")
        for one in use.launched.nodes:
            for _, new in one.remaps if one.certain and one.name is not None else ():
                yield span, resolved(new, one.name or "", {}), f", to which {one.place} remaps"


def _topics_of(context: RuleContext, space: str) -> set[str]:
    robot = context.robot_by_namespace[space]
    command = context.command_topics.get(robot)
    taken = {command.topic.removeprefix(f"{space}/")} if command is not None else set()
    return taken | set(context.sensors_of(robot))


@rule("PKG013", needs="ros1-nodes")
def frames(context: RuleContext) -> Iterator[Diagnostic]:
    """A parameter names a frame that no robot of the swarm has."""
    prefixes = {namespace[1:] for namespace in context.robot_by_namespace}
    published = _others_publish(context)
    for span, key, value, where in _parameters(context):
        if not _FRAME.fullmatch(key):
            continue
        head, slash, rest = value.strip().removeprefix("/").partition("/")
        if slash and rest in _OF_DRIVERS and head not in prefixes:
            meant = nearest(head, tuple(sorted(prefixes)))
        elif not slash and head == "base_link" and not published:
            meant, rest = next(iter(sorted(prefixes))), head
        else:
            continue
        yield Diagnostic(
            "PKG013",
            f"no robot has the frame `{value}`, which `{key}` names{where}",
            span,
            label="no transform from it or to it",
            help=(f"did you mean `{meant}/{rest}`?",)
            if meant and slash
            else (f"frames begin with the name of their robot, as in `{next(iter(prefixes))}/{rest}`",),
        )


def _others_publish(context: RuleContext) -> bool:
    """True if a program publishes frames of its own, from a URDF or as constants."""
    started = {one.executable for one in context.spec.programs.values()}
    started |= {node.executable for one in context.launches for node in one.launched.nodes}
    return bool(started & _PUBLISHERS)


def _parameters(context: RuleContext) -> Iterator[tuple[Span, str, str, str]]:
    for name, program in context.spec.programs.items():
        kind, values = program.named_values
        for key, value in values.items():
            if isinstance(value, str):
                yield context.span("programs", name, kind, key), key, value, ""
    for use in context.launches:
        given = {value for value in use.started.named_values[1].values() if isinstance(value, str)}
        for one in use.launched.parameters:
            if one.value is not None and one.value not in given:
                yield context.launch_span(use, "launch"), one.name, one.value, f" ({one.place})"
