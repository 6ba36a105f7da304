"""From a path to the text of a draft: which kind of files these are, their draft, and its check."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from swarmctl.diagnostics import Diagnostic
from swarmctl.importing.ansible_hosts import (
    InventoryError,
    draft_from_inventory,
    is_ini_inventory,
    is_yaml_inventory,
)
from swarmctl.importing.beyond_spec import beyond
from swarmctl.importing.clearpath_robot import draft_from_clearpath, is_clearpath
from swarmctl.importing.compose_services import is_compose, is_compose_of_ros_1
from swarmctl.importing.crazyflies import is_crazyflies
from swarmctl.importing.dds_profiles import rmw_of
from swarmctl.importing.draft import Draft, lines_beyond, lines_of, summary, text_of_lines, with_errors
from swarmctl.importing.file_kinds import counted, unused
from swarmctl.importing.lab_folder import (
    PYTHON,
    YAML,
    LabFolder,
    is_launch_xml,
    is_of_variables,
    lab_folder,
)
from swarmctl.importing.lab_hosts import arrange
from swarmctl.importing.lab_scripts import Ros, ros_of
from swarmctl.importing.ros1_lab import draft_from_launch
from swarmctl.importing.ros2_lab import draft_from_ros_2, is_ros_2_launch
from swarmctl.importing.script_text import is_image
from swarmctl.importing.tmux_sessions import is_session, without_erb
from swarmctl.linter.runner import check_files
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.ros_packages.launch_files import Place
from swarmctl.ros_packages.package import NO_PACKAGES
from swarmctl.rulebook import Severity
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import Document
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.files import LoadBudget, content


class Kind(str, Enum):
    """What a lab's files are."""

    LAUNCH = "launch"
    ROS_2 = "ros2"
    ANSIBLE = "ansible"
    CLEARPATH = "clearpath"


_WHAT = {
    Kind.LAUNCH: "launch files, scripts or Compose files of ROS 1",
    Kind.ROS_2: "launch files, scripts or Compose files of ROS 2, or a crazyflies.yaml",
    Kind.ANSIBLE: "an Ansible inventory",
    Kind.CLEARPATH: "a Clearpath robot.yaml",
}
_TOGETHER = ({Kind.ANSIBLE, Kind.LAUNCH}, {Kind.ANSIBLE, Kind.ROS_2}, {Kind.CLEARPATH, Kind.ROS_2})
_READS = f"import reads {'; '.join(_WHAT.values())}"


class DraftError(Exception):
    """Nothing can be drafted. The first argument is the problem, the others are what to do."""


@dataclass(frozen=True)
class Imported:
    """The text of a draft, and a summary of what it has."""

    text: str
    summary: str


def imported(path: Path, kind: Kind | None, spec: Path) -> Imported:
    """Returns the draft of what lies at ``path``, to become the file ``spec``. Raises `DraftError`."""
    draft = _drafted(path, kind, spec)
    lines = lines_of(draft)
    lines = with_errors(lines, _errors(text_of_lines(lines).encode(), spec))
    return Imported(text_of_lines(lines), summary(draft, lines))


def compared(path: Path, kind: Kind | None, document: Document, spec: Path) -> Imported:
    """Returns what lies at ``path`` and is not in a spec. Raises `DraftError`."""
    draft = _drafted(path, kind, spec)
    unread = len(dict.fromkeys(draft.unread))
    lines = lines_beyond(beyond(draft, document.spec), str(spec))
    return Imported(text_of_lines(lines), f"{unread} not read" if unread else "")


def _drafted(path: Path, kind: Kind | None, spec: Path) -> Draft:
    if not path.exists():
        raise DraftError(f"there is no file or folder `{path}`", _READS)
    folder = lab_folder(path)
    if isinstance(folder, Diagnostic):
        place = f"{folder.span}: " if folder.span else ""
        raise DraftError(f"{place}{folder.message}", *folder.help)
    draft = _draft(path, folder, kind, spec)
    draft.unread[:0] = folder.unread
    others = {
        one for one in folder.others if one.endswith((".j2", "justfile", "Justfile", "akefile", "user-data"))
    }
    left = {one for one in folder.candidates() if not one.startswith("README.")} - draft.files
    draft.unread += unused(left | others, folder.texts)
    if not draft.hosts:
        problem = f"`{path}` names no host, robot or program that can be imported"
        raise DraftError(problem, *draft.unread[:5], "swarmctl init writes a first spec")
    arrange(draft)
    return draft


def _draft(path: Path, folder: LabFolder, kind: Kind | None, spec: Path) -> Draft:
    found = _chosen(path, folder, _kinds(folder), kind)
    known = load_catalog(spec.parent / "robots").types
    draft = _of_kinds(path, folder, found, known)
    draft.files |= {one for files in found.values() for one in files}
    draft.files |= {one for one in folder.texts if one.rpartition("/")[2].startswith(".env")}
    return draft


def _of_kinds(
    path: Path,
    folder: LabFolder,
    found: Mapping[Kind, Sequence[str]],
    known: Mapping[str, AnyRobotType],
) -> Draft:
    first = None
    if Kind.CLEARPATH in found:
        first = draft_from_clearpath(folder, found[Kind.CLEARPATH], known)
    elif Kind.ANSIBLE in found:
        first = _of_inventory(path, folder, found[Kind.ANSIBLE], known)
    if first is not None and len(found) > 1:
        first.source += ", and launch files and scripts"
    if Kind.LAUNCH in found:
        return draft_from_launch(folder, known, first)
    return draft_from_ros_2(folder, known, first) if Kind.ROS_2 in found or not first else first


def _of_inventory(
    path: Path, folder: LabFolder, files: Sequence[str], known: Mapping[str, AnyRobotType]
) -> Draft:
    if len(files) > 1:
        raise DraftError(
            f"`{path}` has {len(files)} inventories: {', '.join(files[:10])}",
            f"name one of them: swarmctl import {path / files[0]}",
        )
    try:
        return draft_from_inventory(folder, files[0], known)
    except InventoryError as error:
        raise DraftError(*error.args) from error


def _errors(text: bytes, spec: Path) -> Mapping[int, str]:
    """The first error that ``swarmctl validate`` reports in each line of a spec."""
    _, found = check_files(
        spec, read=lambda one: text if one == spec else content(one), search=lambda _: NO_PACKAGES
    )
    errors: dict[int, str] = {}
    for one in found.diagnostics:
        if one.severity is Severity.ERROR and one.span is not None and one.span.file == str(spec):
            errors.setdefault(one.span.line, f"{one.message} [{one.code}]")
    return errors


def _kinds(folder: LabFolder) -> Mapping[Kind, Sequence[str]]:
    """The files of each kind, judged by what they contain."""
    found: dict[Kind, list[str]] = {}
    for path in folder.candidates():
        kind = None if is_of_variables(path) else _kind(path, folder)
        if kind is not None:
            found.setdefault(kind, []).append(path)
    either = [path for path, one in folder.scripts.items() if ros_of(one) is Ros.EITHER]
    if either and not found.keys() & {Kind.LAUNCH, Kind.ROS_2}:
        found[Kind.ROS_2] = either
    return found


def _kind(path: str, folder: LabFolder) -> Kind | None:
    """The kind of one file. One that is not YAML is added to what is not read."""
    text = folder.texts[path]
    if is_ros_2_launch(path, text):
        return Kind.ROS_2
    if path.endswith(PYTHON) or is_image(path):
        return None
    if is_launch_xml(path) and "<launch" in text:
        return Kind.LAUNCH
    if path.endswith(".xml"):
        return Kind.ROS_2 if rmw_of(text) else None
    if path.endswith(YAML):
        root, problem = compose(without_erb(text), path, LoadBudget())
        if problem is not None:  # its message might show a secret
            line = problem.span.line if problem.span else 0
            folder.unread.append(f"{Place(path, line)}: it is not one valid document of YAML")
        if is_compose(root):
            return Kind.LAUNCH if is_compose_of_ros_1(text) else Kind.ROS_2
        if is_crazyflies(root):
            return Kind.ROS_2
        if is_session(root):
            return _kind_of_script(path, folder)
        return Kind.CLEARPATH if is_clearpath(root) else Kind.ANSIBLE if is_yaml_inventory(root) else None
    return _kind_of_script(path, folder) or (Kind.ANSIBLE if is_ini_inventory(path, text) else None)


def _kind_of_script(path: str, folder: LabFolder) -> Kind | None:
    script = folder.scripts.get(path)
    ros = ros_of(script) if script else None
    return Kind.LAUNCH if ros is Ros.ONE else Kind.ROS_2 if ros is Ros.TWO else None


def _chosen(
    path: Path, folder: LabFolder, found: Mapping[Kind, Sequence[str]], kind: Kind | None
) -> Mapping[Kind, Sequence[str]]:
    """The files of the kind that is given, of the only one there is, or or of those that are one draft."""
    if kind is not None and kind in found:
        return {kind: found[kind]}
    if kind is None and (len(found) == 1 or found.keys() in _TOGETHER):
        return found
    ways = [f"swarmctl import {path} --from {one.value}" for one in found]
    if not found:
        has = counted((*folder.candidates(), *folder.others), folder.texts)
        problem = f"`{path}` has nothing that can be imported: {has or 'no file'}"
        ways = [_READS, *folder.unread[:5], "name the file or the folder that has it, or: swarmctl init"]
    elif kind is not None:
        problem = f"`{path}` has not {_WHAT[kind]} that can be read"
    else:
        has = "; ".join(f"{_WHAT[one]} ({files[0]})" for one, files in found.items())
        problem = f"`{path}` has several kinds of files: {has}"
    raise DraftError(problem, *ways)
