"""Requests and answers of the verbs that prepare a host and build packages on it; see ``messages``."""

from __future__ import annotations

from typing import Literal, TypedDict

from .messages import Facts
from .probe_messages import ImageAnswer, ImageRequest

DebianState = Literal["installed", "available", "unknown"]
WorkspaceState = Literal["built", "sources", "absent"]


class AccountState(TypedDict):
    """``exists``; ``keys``: some key logs in to it; ``sudo``: runs all without a password; its ``groups``."""

    exists: bool
    keys: bool
    sudo: bool
    groups: list[str]


class InventoryRequest(TypedDict):
    """What the host has of what it may need. ``requires`` as for ``observe``; ``debian``: names
    of Debian packages, ``pip``: names with an optional ``==version``; ``groups``: which of these exist;
    ``rosdep``: keys of package.xml files, to be looked up for the ROS ``distro``."""

    verb: Literal["inventory"]
    swarm: str
    requires: list[str]
    debian: list[str]
    pip: list[str]
    account: str
    groups: list[str]
    workspaces: list[str]
    rosdep: list[str]
    distro: str
    images: list[ImageRequest]


class InventoryAnswer(TypedDict):
    """``debian``: state by package; ``pip``: version or null by requirement; ``workspaces``: by path;
    ``rosdep``: Debian packages by key, as far as the host's rosdep knows them; ``sources``: servers of
    apt; ``images``: in the order of the request; ``wireless``: interfaces with a radio."""

    facts: Facts
    debian: dict[str, DebianState]
    pip: dict[str, str | None]
    account: AccountState
    groups: list[str]
    workspaces: dict[str, WorkspaceState]
    rosdep: dict[str, list[str]]
    sources: list[str]
    images: list[ImageAnswer]
    wireless: list[str]


class PrepareRequest(TypedDict):
    """One step: add a ``source`` of packages, ``refresh`` the lists of packages, install by ``apt`` or
    ``pip``, ``pull`` images, named as ENGINE IMAGE, create ``account``, give it the ``keys`` of the account
    ``login``, a ``sudo`` rule or a ``group``, ``build`` workspaces.

    ``workspaces``: those of the host in their order; each is built upon those behind it."""

    verb: Literal["prepare"]
    swarm: str
    step: str
    targets: list[str]
    account: str
    login: str
    workspaces: list[str]


class PrepareAnswer(TypedDict):
    """``step``: the one that is done."""

    step: str


class BuildRequest(TypedDict):
    """Build the packages in the payload, a tar.gz of ``PACKAGE/path``, upon the ``workspaces`` of the host.

    ``packages``: those whose results are wanted; ``folders``: by package what errors call its folder.
    """

    verb: Literal["build_packages"]
    swarm: str
    account: str
    workspaces: list[str]
    packages: list[str]
    folders: dict[str, str]


class BuildAnswer(TypedDict):
    """``sizes``: by package, bytes of its results, a tar.gz; ``platform``: what they are compiled for."""

    platform: str
    sizes: dict[str, int]


class FetchBuildRequest(TypedDict):
    """A piece of the results of a ``package``, from the byte ``offset`` on."""

    verb: Literal["fetch_build"]
    swarm: str
    package: str
    offset: int


class FetchBuildAnswer(TypedDict):
    """``data``: the piece in base64."""

    data: str
