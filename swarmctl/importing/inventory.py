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

from swarmctl.importing.draft import Unread
from swarmctl.importing.lab_folder import SCRIPTS, VARIABLES
from swarmctl.importing.yaml_trees import VAULT_FILE, pairs
from swarmctl.ros_packages.launched import Place

MAX_HOSTS = 2_000
_MEMORY = 1 << 30  # bytes
_TIMEOUT = 60.0  # s
_PARTS = {"hosts", "children", "vars"}
_SECTION = re.compile(r"^\s*\[([^\[\]]+)\].*$", re.MULTILINE)
_HOST = re.compile(r"[^\s=]+(?:\s+\w+=.*)?")


class InventoryError(Exception):
    """An inventory that cannot be read. The first argument is the problem, the others are what to do."""


@dataclass(frozen=True)
class Variable:
    """The value of a variable as text, empty if it is not a scalar; ``is_vault`` if it is encrypted."""

    value: str
    is_vault: bool = False


Variables = Mapping[str, Variable]


@dataclass(frozen=True)
class Inventory:
    """The variables of each host, with those of its groups, and its groups, from general to specific ones."""

    hosts: Mapping[str, Variables]
    groups: Mapping[str, tuple[str, ...]]
    unread: tuple[Unread, ...] = ()


def is_yaml_inventory(root: yaml.Node | None) -> bool:
    """Returns True if all keys at the top of a YAML file are groups, one with hosts or children."""
    groups = [{part for part, _, _ in pairs(value)} for _, value, _ in pairs(root)]
    return any({"hosts", "children"} & one for one in groups) and all(one <= _PARTS for one in groups)


def is_ini_inventory(path: str, text: str) -> bool:
    """Returns True for a file with `ansible_` variables, or with nothing but hosts and groups of hosts."""
    if text.startswith("#!") or path.endswith(SCRIPTS):
        return False
    if "ansible_" in text:
        return True
    first, *rest = _SECTION.split(text)
    bodies = [
        first,
        *(body for name, body in zip(rest[::2], rest[1::2], strict=True) if name[-5:] != ":vars"),
    ]
    written = [line.strip() for body in bodies for line in body.split("\n")]
    lines = [line for line in written if line and line[0] not in "#;"]
    is_named = posixpath.basename(path).startswith(("inventory", "hosts"))
    return bool(lines and (rest or is_named)) and all(map(_HOST.fullmatch, lines))


def inventory(texts: Mapping[str, str], path: str) -> Inventory:
    """Returns the inventory of a file in ``texts``, with variables of the files beside it.

    Raises ``InventoryError``. Ansible reads copies of these files alone, in a folder of their own.
    """
    beside = posixpath.dirname(path)
    variables = {
        one: text
        for one, text in texts.items()
        if posixpath.relpath(one, beside or ".").split("/")[0] in VARIABLES
    }
    encrypted = [one for one, text in variables.items() if text.startswith(VAULT_FILE)]
    try:
        with tempfile.TemporaryDirectory() as folder:
            for one in ({path: texts[path]} | variables).keys() - encrypted:
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
    if len(groups) > MAX_HOSTS:
        raise InventoryError(f"{path} has more than {MAX_HOSTS} hosts", "import a part of it")
    return Inventory(
        {name: {key: _variable(one) for key, one in hosts.get(name, {}).items()} for name in groups},
        groups,
        tuple(Unread(Place(one, 0), "the whole file is encrypted by ansible-vault") for one in encrypted),
    )


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


def _variable(value: Any) -> Variable:
    if isinstance(value, dict) and "__ansible_vault" in value:
        return Variable("", is_vault=True)
    if isinstance(value, dict) and "__ansible_unsafe" in value:
        value = value["__ansible_unsafe"]
    return Variable("" if isinstance(value, dict | list) else str(value))
