"""From a path to the text of a draft: which kind of files these are, their draft, and its check."""

from __future__ import annotations

import posixpath
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from swarmctl.diagnostics import Diagnostic
from swarmctl.importing.ansible_hosts import draft_from_inventory
from swarmctl.importing.clearpath_robot import draft_from_clearpath, is_clearpath
from swarmctl.importing.draft import Counts, Draft, Unread, counts
from swarmctl.importing.draft_text import lines_of, text_of_lines, with_errors
from swarmctl.importing.env_files import is_env_file
from swarmctl.importing.inventory import InventoryError, is_ini_inventory, is_yaml_inventory
from swarmctl.importing.lab_folder import LAUNCH, VARIABLES, YAML, LabFolder, lab_folder
from swarmctl.importing.launched_lab import draft_from_launch
from swarmctl.importing.yaml_trees import tree_of
from swarmctl.linter.runner import check_files
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.ros_packages.package import NO_PACKAGES
from swarmctl.rulebook import Severity
from swarmctl.spec.catalog import load_catalog
from swarmctl.yamltext.files import content


class Kind(str, Enum):
    """What a lab's files are."""

    LAUNCH = "launch"
    ANSIBLE = "ansible"
    CLEARPATH = "clearpath"


_WHAT = {
    Kind.LAUNCH: "launch files or scripts that set ROS_MASTER_URI, ROS_IP or ROS_HOSTNAME",
    Kind.ANSIBLE: "an Ansible inventory",
    Kind.CLEARPATH: "a Clearpath robot.yaml",
}


class DraftError(Exception):
    """Nothing can be drafted. The first argument is the problem, the others are what to do."""


@dataclass(frozen=True)
class Imported:
    """The text of a draft, and what it has."""

    text: str
    counts: Counts


def imported(path: Path, kind: Kind | None, spec: Path) -> Imported:
    """Returns the draft of what lies at ``path``, to become the file ``spec``. Raises `DraftError`."""
    if not path.exists():
        raise DraftError(f"there is no file or folder `{path}`", f"import reads {'; '.join(_WHAT.values())}")
    folder = lab_folder(path)
    if isinstance(folder, Diagnostic):
        place = f"{folder.span}: " if folder.span else ""
        raise DraftError(f"{place}{folder.message}", *folder.help)
    found = _kinds(folder)
    chosen = _chosen(path, folder, found, kind)
    files = found[chosen]
    if chosen is not Kind.LAUNCH and len(files) > 1:
        example = next((one for one in files if "/" not in one), files[0])
        several = "inventories" if chosen is Kind.ANSIBLE else "robot.yaml files"
        raise DraftError(
            f"`{path}` has {len(files)} {several}: {', '.join(files[:10])}",
            f"name one of them: swarmctl import {path / example}",
        )
    draft = _draft(folder, chosen, files, with_protocol(load_catalog(spec.parent / "robots").types))
    if not (draft.hosts or draft.robots or draft.programs):
        why = tuple(f"{one.place}: {one.why}" for one in draft.unread[:5])
        raise DraftError(
            f"`{path}` names no host, robot or program that can be imported",
            *why,
            "swarmctl init writes a first spec",
        )
    return checked(draft, spec)


def _draft(folder: LabFolder, kind: Kind, files: Sequence[str], types: Mapping[str, RobotType]) -> Draft:
    if kind is Kind.LAUNCH:
        return draft_from_launch(folder, types)
    if kind is Kind.CLEARPATH:
        return draft_from_clearpath(folder, files[0])
    try:
        return draft_from_inventory(folder, files[0], types)
    except InventoryError as error:
        raise DraftError(*error.args) from error


def checked(draft: Draft, spec: Path) -> Imported:
    """Returns the text of a draft, in which every error that ``swarmctl validate`` reports is to fill in."""
    lines = lines_of(draft)
    text = text_of_lines(lines).encode()
    _, found = check_files(
        spec, read=lambda one: text if one == spec else content(one), search=lambda _: NO_PACKAGES
    )
    errors: dict[int, str] = {}
    for one in found.diagnostics:
        if one.severity is Severity.ERROR and one.span is not None and one.span.file == str(spec):
            errors.setdefault(one.span.line, f"{one.message} [{one.code}]")
    marked, added = with_errors(lines, errors)
    return Imported(text_of_lines(marked), counts(draft, added))


def _kinds(folder: LabFolder) -> Mapping[Kind, Sequence[str]]:
    """The files of each kind, judged by what they contain."""
    found: dict[Kind, list[str]] = {kind: [] for kind in Kind}
    for path in folder.candidates():
        kind = _kind(path, folder.texts[path])
        if kind is not None:
            found[kind].append(path)
    return {kind: files for kind, files in found.items() if files}


def _kind(path: str, text: str) -> Kind | None:
    if any(part in VARIABLES for part in posixpath.dirname(path).split("/")):
        return None
    if path.endswith(LAUNCH):
        return Kind.LAUNCH
    if path.endswith((*YAML, ".json")):
        root = tree_of(path, text)
        if isinstance(root, Unread):
            return None
        return Kind.CLEARPATH if is_clearpath(root) else Kind.ANSIBLE if is_yaml_inventory(root) else None
    if is_env_file(text):
        return Kind.LAUNCH
    return Kind.ANSIBLE if is_ini_inventory(path, text) else None


def _unread(folder: LabFolder) -> Sequence[str]:
    """Files that may be what is looked for, and why they cannot be read."""
    found = list(folder.unread)
    for path in folder.candidates():
        root = tree_of(path, folder.texts[path]) if path.endswith((*YAML, ".json")) else None
        found += [root] if isinstance(root, Unread) else []
    return [f"{one.place}: {one.why}" for one in found[:5]]


def _chosen(path: Path, folder: LabFolder, found: Mapping[Kind, Sequence[str]], kind: Kind | None) -> Kind:
    """The kind that is given, or the only one there is."""
    if kind is not None:
        if kind in found:
            return kind
        raise DraftError(
            f"`{path}` is not {_WHAT[kind]}, and has none that can be read", *_others(path, found)
        )
    if not found:
        raise DraftError(
            f"`{path}` has nothing that can be imported",
            f"import reads {'; '.join(_WHAT.values())}",
            *_unread(folder),
            "name the file or the folder that has it, or begin with: swarmctl init",
        )
    if len(found) > 1:
        has = "; ".join(f"{_WHAT[one]} ({files[0]})" for one, files in found.items())
        raise DraftError(
            f"`{path}` has several kinds of files: {has}",
            *(f"swarmctl import {path} --from {one.value}" for one in found),
        )
    return next(iter(found))


def _others(path: Path, found: Mapping[Kind, Sequence[str]]) -> Sequence[str]:
    if not found:
        return ("name the file or the folder that has it",)
    return [f"it has {_WHAT[one]}: swarmctl import {path} --from {one.value}" for one in found]
