"""The messages of the common ROS 1 packages with their checksums (templates/data/messages.yaml)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import yaml

from swarmctl import resources
from swarmctl.ros_packages.message_definitions import Definition, checksums
from swarmctl.ros_packages.package import Packages


@dataclass(frozen=True)
class MessageCatalog:
    """The message types of packages with their MD5 sums, and the services and actions of the same packages.

    A sum is empty where it is not known.
    """

    sums: Mapping[str, str]
    services: frozenset[str]
    actions: frozenset[str]
    packages: frozenset[str]


@cache
def common_messages() -> MessageCatalog:
    """Returns the messages of the packages that ROS and its common stacks bring."""
    file = resources.templates() / "data/messages.yaml"
    packages = yaml.load(file.read_text("utf-8"), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    sums: dict[str, str] = {}
    others: dict[str, set[str]] = {"services": set(), "actions": set()}
    for package, one in packages.items():
        sums.update((f"{package}/{name}", value) for name, value in one["messages"].items())
        for kind, names in others.items():
            names.update(f"{package}/{name}" for name in one.get(kind, ()))
    return MessageCatalog(
        sums, frozenset(others["services"]), frozenset(others["actions"]), frozenset(packages)
    )


def with_messages_of(packages: Packages, known: MessageCatalog) -> MessageCatalog:
    """Returns the catalog with the messages of packages; what it has itself keeps its sum."""
    own: dict[str, Definition] = {}
    with_files: set[str] = set()
    for package in packages.found:
        definitions, _ = package.definitions
        own.update(definitions)
        if definitions:
            with_files.add(package.name)
    sums = checksums(own, known.sums)
    return MessageCatalog(
        {**dict.fromkeys(own, ""), **sums, **known.sums},
        known.services,
        known.actions,
        known.packages | with_files,
    )
