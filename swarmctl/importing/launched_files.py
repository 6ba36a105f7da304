"""What the launch files, scripts and Compose files of a folder start, and what of it a draft has not."""

from __future__ import annotations

import posixpath
import re
import shlex
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from swarmctl.importing.compose_services import Service, is_compose, is_compose_of_ros_1, services_of
from swarmctl.importing.draft import Value
from swarmctl.importing.lab_folder import YAML, LabFolder
from swarmctl.importing.lab_scripts import Evaluate, Ros, Started, ros_of, started_by
from swarmctl.importing.recognition import driver_files, drivers_of
from swarmctl.importing.script_text import is_image
from swarmctl.importing.shell_script import Command, read_script
from swarmctl.importing.unknown_values import quotes_secret
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.ros_packages.launch_files import (
    Include,
    Launched,
    Node,
    Place,
    Refusal,
)
from swarmctl.ros_packages.package import Package
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.files import LoadBudget

LIMIT = 20_000  # elements of all launch files together
NOT_STARTED = "it is not started"
_ALL = "the-imported-folder"  # as a package, so that its launch files may include each other


@dataclass(frozen=True)
class Found:
    """What the files of a folder start: ``launched`` by launch file or script, but what others include."""

    services: Mapping[str, tuple[Service, Started]]
    started: Sequence[Started]
    launched: Mapping[str, Launched]
    files: set[str]

    @property
    def starts_nodes(self) -> bool:
        """True if a node, a launch file or a container is started."""
        return bool(self.services) or any(one.nodes or one.includes for one in self.launched.values())


def found_in(
    folder: LabFolder,
    ros: Ros,
    types: Mapping[str, AnyRobotType],
    is_launch: Callable[[str], bool],
    evaluate: Callable[[Package, str, Mapping[str, str | None], str, int], Launched],
) -> Found:
    """Returns what the files of one ROS start; ``is_launch`` returns True for the path of a launch file."""
    whole, packages = whole_folder(folder)
    closed = driver_files(packages, types)

    def one(
        package: Package, path: str, given: Mapping[str, str | None], namespace: str, limit: int
    ) -> Launched | None:
        is_driver = posixpath.normpath(posixpath.join(package.folder, path)) in closed
        return None if is_driver else evaluate(package, path, given, namespace, limit)

    def read(path: str, limit: int) -> Launched | None:
        return evaluate(whole, path, {}, "", limit) if is_launch(path) else None

    services = services_in(folder, ros, types)
    started = [*scripts_of(folder, ros, one), *(one for _, one in services.values())]
    started.sort(key=lambda one: is_image(one.path))  # a service may set other values than its image
    every = {**launched_in(folder, read, closed), **{one.key: one.launched for one in started}}
    return Found(services, started, not_included(every), files_of(folder, every))


def scripts_of(folder: LabFolder, ros: Ros, evaluate: Evaluate) -> Sequence[Started]:
    """Returns what the scripts of one ROS set and start, by computer."""
    whole, packages = whole_folder(folder)
    left, found = LIMIT, list[Started]()
    for path, script in folder.scripts.items():
        if ros_of(script) in (ros, Ros.EITHER):
            found += started_by(path, script, packages, whole, evaluate, limit=left)
            left = LIMIT - sum(one.launched.cost for one in found)
    return found


def services_in(
    folder: LabFolder, ros: Ros, types: Mapping[str, AnyRobotType]
) -> Mapping[str, tuple[Service, Started]]:
    """Returns the services of Compose files of one ROS, each with what it sets, and the drivers it starts."""
    found: dict[str, tuple[Service, Started]] = {}
    drivers = drivers_of(types)
    for path in folder.candidates():
        text = folder.texts[path]
        if not path.endswith(YAML) or not is_compose(compose(text, path, LoadBudget())[0]):
            continue
        if (Ros.ONE if is_compose_of_ros_1(text) else Ros.TWO) is not ros:
            continue
        services, others = services_of(folder, path)
        shared = _shared(services)
        for one in services:
            one.of_swarm = shared
            here = started_in(path, one)
            here.variables = dict(shared)
            here.unread |= dict.fromkeys(others)
            here.launched.includes = [
                two
                for two in here.launched.includes
                if (two.package, posixpath.basename(two.file)) in drivers
            ]
            found[here.key] = one, here
    return found


def _shared(services: Sequence[Service]) -> Mapping[str, Value]:
    """The variables of ROS that all services of a file have with the same value; others stay in theirs."""
    first = services[0].variables if services else {}
    return {
        name: one
        for name, one in first.items()
        if all(name in two.variables and two.variables[name].value == one.value for two in services)
    }


def started_in(path: str, service: Service) -> Started:
    """Returns what the command of a service sets and starts."""
    script = read_script(path, {path: shlex.join(service.command)})
    environment = {name: one.value or "" for name, one in service.environment.items() if one.value}
    steps = [
        replace(one, place=service.place, environment=environment)
        if isinstance(one, Command)
        else replace(one, place=service.place)
        for one in script.steps
        if one.remote is None
    ]
    nothing = Package("", "", frozenset(), {}, {})
    made = started_by(path, replace(script, steps=steps), {}, nothing, lambda *_: Launched(), limit=0)
    here = next(iter(made), Started(path, None, service.place))
    here.name, here.launched.nodes, here.unread = service.name, [], dict.fromkeys(service.unread)
    here.launched.files[here.key] = None
    return here


def reasons(launched: Mapping[str, Launched]) -> Mapping[tuple[Place, str], Mapping[str, str]]:
    """Returns on what the attributes depend that are not known, by what starts them."""
    found: dict[tuple[Place, str], dict[str, str]] = {}
    for path, one in launched.items():
        for (place, key), why in one.unknown.items():
            found.setdefault((normal(place), key), {})[path] = why
    return found


def launched_in(
    folder: LabFolder, read: Callable[[str, int], Launched | None], closed: Mapping[str, str]
) -> Mapping[str, Launched]:
    """Returns what each launch file brings, by its path. ``read`` returns None for what is none.

    One of the files ``closed`` brings its robot, and not what its driver starts.
    """
    left, found = LIMIT, dict[str, Launched]()
    for path in sorted(folder.candidates()):
        one = read(path, left)
        if one is not None:
            left -= one.cost
            found[path] = one
        if one is not None and path in closed:
            include = Include(closed[path], posixpath.basename(path), "", {}, Place(path, 0), certain=True)
            why = "what it starts: the driver of a robot's type replaces it"
            found[path] = Launched(files=one.files, includes=[include], left_out=[(include.place, why)])
    return found


def whole_folder(folder: LabFolder) -> tuple[Package, Mapping[str, Package]]:
    """Returns the files of a folder as one package, and all packages that launch files may name."""
    texts = {path: text.encode() for path, text in folder.texts.items()}
    whole = Package(_ALL, "", frozenset(), dict.fromkeys(texts, False), texts)
    found = {name: _with_texts(one, texts) for name, one in folder.packages.by_name.items()}
    return whole, {**found, _ALL: whole}


def _with_texts(package: Package, texts: Mapping[str, bytes]) -> Package:
    """A package with those files of the folder that lie in it."""
    inside = "" if package.folder == "." else f"{package.folder}/"
    own = {path[len(inside) :]: text for path, text in texts.items() if path.startswith(inside)}
    return replace(package, contents={**package.contents, **own})


def files_of(folder: LabFolder, launched: Mapping[str, Launched]) -> set[str]:
    """Returns the files that launch files and scripts include."""
    included = {posixpath.normpath(file) for one in launched.values() for file in one.files}
    return included | {other for one in folder.scripts.values() for other in one.others}


def not_included(found: Mapping[str, Launched]) -> Mapping[str, Launched]:
    """Returns what each launch file starts that no other one includes."""
    included = {
        file for path, one in found.items() for file in map(posixpath.normpath, one.files) if file != path
    }
    return {path: one for path, one in found.items() if path not in included}


def nodes_in(
    launched: Mapping[str, Launched], apart: Collection[str] = ()
) -> Iterator[tuple[Sequence[str], Node]]:
    """Every node once, with all that starts it; of those that are ``apart`` each starts its own."""
    seen: dict[tuple[Node, str], tuple[list[str], Node]] = {}
    for path, one in launched.items():
        for node in one.nodes:
            key = (node, path if path in apart else "")  # one with other parameters is another one
            if key not in seen:
                settings = tuple(replace(one, place=normal(one.place)) for one in node.parameters)
                texts = tuple(replace(one, place=normal(one.place)) for one in node.rosparams)
                place = normal(node.place)
                seen[key] = [], replace(node, place=place, parameters=settings, rosparams=texts)
            seen[key][0].append(path)
    yield from seen.values()


def unread(launched: Mapping[str, Launched]) -> Iterator[str]:
    """Yields what of launch files a draft does not have."""
    sections: dict[tuple[str, str], bool] = {}
    for one in launched.values():
        for (file, key), is_used in one.sections.items():
            section = posixpath.normpath(file), key
            sections[section] = sections.get(section, False) or is_used
    for (file, key), is_used in sections.items():
        if not is_used:
            yield f"{file}: its parameters of {key}: no node that gets this file has that name"
    started = {normal(one.place) for each in launched.values() for one in each.nodes if one.certain}
    started |= {normal(one.place) for each in launched.values() for one in each.includes if one.certain}
    for path, one in launched.items():
        if not one.files and not one.faults:
            yield f"{path}: it, or all launch files together, are too large"
        yield from _without_effect(one)
        for place, why in one.left_out:
            shown = "what stands here may have a secret" if quotes_secret(why) else why
            if why.startswith(NOT_STARTED) and normal(place) in started:
                continue  # by another file
            by = file_of(path)
            shown += f", of {by}" if why.startswith(NOT_STARTED) and by != normal(place).file else ""
            yield f"{normal(place)}: {shown}"
        unfound = (place for place in one.unfound if (place, "file") not in one.unknown)
        yield from (f"{normal(place)}: the included file is not here" for place in unfound)
        for fault in one.faults:
            if fault.kind is Refusal.MISSING:
                yield f"{normal(fault.place)}: the argument `{fault.subject}` is given when it is launched"
            elif fault.kind in (Refusal.BROKEN, Refusal.SKIPPED):
                yield f"{normal(fault.place)}: {fault.text}"


def _without_effect(launched: Launched) -> Iterator[str]:
    """The remaps and variables of no node."""
    remaps = {pair for node in launched.nodes for pair in node.remaps}
    for (old, new), place in launched.remaps.items():
        if (old, new) not in remaps:
            yield f"{normal(place)}: the remap from {old} to {new} is of no node here"
    kept = [one.environment for one in launched.nodes] + [one.environment for one in launched.includes]
    variables = {(one.place, one.name) for environment in kept for one in environment}
    for one in launched.environment:
        if (one.place, one.name) not in variables:
            yield f"{normal(one.place)}: the variable {one.name} is of no node here"


def file_of(started: str) -> str:
    """Returns the file of what starts something, which may also name a computer or a service."""
    return re.split(r" on |: ", started)[0]


def normal(place: Place) -> Place:
    """Returns a place whose path has no `..`."""
    return Place(posixpath.normpath(place.file), place.line)
