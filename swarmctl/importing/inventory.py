"""An Ansible inventory as ``ansible-inventory`` of ansible-core reads it; no script or plugin of it runs."""

from __future__ import annotations

import json
import os
import posixpath
import re
import resource
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import networkx
import yaml

from swarmctl.importing.lab_folder import SCRIPTS, VARIABLES
from swarmctl.yamltext.compose import pairs_of

_MEMORY = 1 << 30  # bytes
_TIMEOUT = 60.0  # s
_VAULT_FILE = "$ANSIBLE_VAULT;"  # how a file begins that ansible-vault encrypts
_PARTS = {"hosts", "children", "vars"}
_SECTION = re.compile(r"\[([^\[\]]+)\]")
_HOST = re.compile(r"[^\s=]+(?:\s+\w+=.*)?")


class InventoryError(Exception):
    """An inventory that cannot be read. The first argument is the problem, the others are what to do."""


Variables = Mapping[str, str | None]
"""The values of variables as text: empty if it is not a scalar, None if ansible-vault encrypts it."""


@dataclass(frozen=True)
class Inventory:
    """The variables of each host, with those of its groups, and its groups, from general to specific ones."""

    hosts: Mapping[str, Variables]
    groups: Mapping[str, tuple[str, ...]]
    encrypted: list[str]  # files of variables


def is_yaml_inventory(root: yaml.Node | None) -> bool:
    """Returns True if all keys at the top of a YAML file are groups, one with hosts or children."""
    groups = [pairs_of(value).keys() for _, value in pairs_of(root).values()]
    return any({"hosts", "children"} & one for one in groups) and all(one <= _PARTS for one in groups)


def is_ini_inventory(path: str, text: str) -> bool:
    """Returns True for a file with `ansible_` variables, or with nothing but hosts and groups of hosts."""
    if text.startswith("#!") or path.endswith(SCRIPTS):
        return False
    if "ansible_" in text:
        return True
    written = [line.strip() for line in text.split("\n")]
    lines, section = [line for line in written if line and line[0] not in "#;"], ""
    for line in lines:
        if match := _SECTION.match(line):
            section = match[1]
        elif not section.endswith(":vars") and not _HOST.fullmatch(line):
            return False
    return bool(section or (lines and posixpath.basename(path).startswith(("inventory", "hosts"))))


def inventory(texts: Mapping[str, str], path: str) -> Inventory:
    """Returns the inventory of a file in ``texts``, with variables of the files beside it.

    Raises ``InventoryError``. Ansible reads copies of these files alone, in a folder of their own.
    """
    beside = posixpath.dirname(path)
    paths = [one for one in texts if posixpath.relpath(one, beside or ".").split("/")[0] in VARIABLES]
    encrypted = [one for one in paths if texts[one].startswith(_VAULT_FILE)]
    try:
        with tempfile.TemporaryDirectory() as folder:
            for one in {path, *paths} - {*encrypted}:
                place = Path(folder, "lab", posixpath.relpath(one, beside or "."))
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_text(texts[one], "utf-8", "surrogateescape")
            found = _listed(Path(folder), posixpath.basename(path), path)
    except OSError as error:
        raise InventoryError(
            f"{path} cannot be copied for ansible-inventory: {error.strerror}",
            f"free space in {tempfile.gettempdir()}, or set TMPDIR",
        ) from error
    hosts: Mapping[str, Mapping[str, Any]] = found.pop("_meta", {}).get("hostvars", {})
    groups = _memberships(found)
    variables = {name: {key: _text(one) for key, one in hosts.get(name, {}).items()} for name in groups}
    return Inventory(variables, groups, encrypted)


def _listed(folder: Path, name: str, path: str) -> dict[str, Any]:
    """What ``ansible-inventory`` prints; its messages are not shown, as they may quote a secret."""
    env = {key: one for key, one in os.environ.items() if not key.startswith("ANSIBLE_")}
    env |= {
        "ANSIBLE_CONFIG": str(folder / "ansible.cfg"),
        "ANSIBLE_HOME": str(folder),
        "ANSIBLE_LOCAL_TEMP": str(folder),
        "ANSIBLE_INVENTORY_ENABLED": "ini,yaml",
        "ANSIBLE_INVENTORY_ANY_UNPARSED_IS_FAILED": "true",
        "ANSIBLE_INVENTORY_UNPARSED_FAILED": "true",
    }
    (folder / "ansible.cfg").touch()
    try:
        done = subprocess.run(
            ["ansible-inventory", "--list", "-i", f"lab/{name}"],
            cwd=folder, env=env, stdin=subprocess.DEVNULL, capture_output=True, timeout=_TIMEOUT, check=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY)),
        )  # fmt: skip
        return dict(json.loads(done.stdout))
    except FileNotFoundError as error:
        raise InventoryError(
            f"reading the Ansible inventory {path} needs the program ansible-inventory",
            "install ansible-core: `apt install ansible-core` or `pip install ansible-core`",
        ) from error
    except (subprocess.SubprocessError, OSError, ValueError, RecursionError) as error:
        raise InventoryError(
            f"ansible-inventory cannot read {path}", f"`ansible-inventory --list -i {path}` shows why"
        ) from error


def _memberships(groups: Mapping[str, Mapping[str, Any]]) -> dict[str, tuple[str, ...]]:
    """The groups of each host; a group comes behind those that it is a child of."""
    below: networkx.DiGraph[str] = networkx.DiGraph()
    for name, one in groups.items():
        below.add_edges_from((name, child) for child in one.get("children", ()))
    found: dict[str, tuple[str, ...]] = {}
    order = list(networkx.topological_sort(below))
    for name in order:
        inside = {name, *networkx.descendants(below, name)}
        for host in (host for one in order if one in inside for host in groups.get(one, {}).get("hosts", ())):
            found[host] = tuple(dict.fromkeys((*found.get(host, ()), name)))
    return found


def _text(value: Any) -> str | None:
    if isinstance(value, dict) and "__ansible_vault" in value:
        return None
    if isinstance(value, dict) and "__ansible_unsafe" in value:
        value = value["__ansible_unsafe"]
    return "" if isinstance(value, dict | list) else str(value)
