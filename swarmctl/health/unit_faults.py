"""What can be wrong with any unit, container image or node, in words. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from posixpath import basename
from urllib.parse import urlsplit

from swarm_onboard.agent.images import Image
from swarm_onboard.agent.observations import NodeSeen
from swarm_onboard.agent.paths import trial_file

from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.verdict import State, Verdict, bad
from swarmctl.spec.program_model import Container

_ADAPTERS, _RFCOMM, _SECRETS = "/sys/class/bluetooth/", "/usr/bin/rfcomm", "/secrets/"


def unmet_conditions(host: str, unit: str, unmet: Sequence[str]) -> tuple[str, str]:
    """Returns why ``unit`` is skipped on ``host``, and the repair.

    ``unmet``: the conditions that are not met now, such as ``ConditionPathExists=/PATH``.
    """
    if not unmet:  # they were not when the unit was to start
        return "a condition was not met when it was to start, and is met now", _start(host, unit)
    places = [one.partition("=")[2] for one in unmet]
    whys, repairs = zip(*(_one(host, place) for place in places), strict=True)
    again = "then run swarmctl deploy"
    return "; ".join(whys), "; ".join((*dict.fromkeys(repairs), again))


def waits_for_trial(unit: str, unmet: Sequence[str]) -> bool:
    """Returns True if nothing but a trial lacks for ``unit`` to run."""
    return list(unmet) == [f"ConditionPathExists={trial_file(unit)}"]


def _one(host: str, place: str) -> tuple[str, str]:
    name = basename(place)
    if place.startswith(_ADAPTERS):
        hint = f"connect it, or correct `adapter` of the link; on {host}: ls {_ADAPTERS} lists those it has"
        return f"{host} has no Bluetooth adapter {name}", hint
    if place == _RFCOMM:
        return f"{host} lacks {place}", "`swarmctl prepare` installs it (package bluez)"
    if _SECRETS in place:
        return f"the secret {name} is not on {host}", f"write it to `secrets/{name}` beside the spec"
    return f"{place} does not exist on {host}", "create it"


def _start(host: str, unit: str) -> str:
    return f"on {host}: sudo systemctl start {unit}"


#: By the machine of a host (uname(2)), the architectures of images that run on it, as Go names them.
_RUNS = {
    "x86_64": ("amd64", "386"),
    "i686": ("386",),
    "aarch64": ("arm64", "arm"),
    "armv8l": ("arm",),
    "armv7l": ("arm",),
    "armv6l": ("arm",),
}


def image_problem(container: Container, host: str, seen: Image | None, unit: Verdict) -> Verdict | None:
    """Returns what the image does to a program whose unit has the verdict ``unit``; None if nothing.

    An image for another machine counts only where the unit does not run: an emulator may run it.
    """
    if seen is None:
        return None
    if seen.error:
        return None if unit.fine else replace(unit, message=f"{unit.message}; {seen.error}")
    if not seen.there:
        engine, image = f"sudo {container.engine}", container.image
        pull = f"on {host}: {engine} pull {image}, which needs a network"
        copy = f"from where it is: {engine} save {image} | ssh {host} {engine} load"
        return bad(f"its image is not on host {host}: {image}", pull if "@" in image else copy)
    if unit.state is State.BAD and seen.built_for not in _RUNS.get(seen.machine, (seen.built_for, "")):
        text = f"its image is built for {seen.built_for}, and host {host} is {seen.machine}: {unit.message}"
        return bad(text, f"pin the digest of the image for {seen.machine}")
    return None


def unchecked(node: str, seen: NodeSeen | None) -> str:
    """Returns the text for a node on which the master did not answer."""
    return f"{node} was not checked" + (f": {seen.error}" if seen is not None and seen.error else "")


def absent(host: ExpectedHost) -> str:
    """Returns the text for a node of ``host`` that the graph does not have."""
    return "is not registered at the master" if host.master_uri else "is not in the graph"


def dead(host: ExpectedHost, seen: NodeSeen) -> str:
    """Returns the text for a node of ``host`` that the graph has, but that is not alive."""
    silent = f"does not answer ({seen.error})"
    return f"is registered, but {silent}" if host.master_uri else silent


def moved(host: ExpectedHost, seen: NodeSeen) -> str:
    """The text for a node that advertises another address than ``host``; empty if it does not.

    Nodes of a middleware whose probe reports no URIs advertise nothing.
    """
    if seen.uri and (advertised := host_of(seen.uri)) != host.advertised.lower():
        return f"advertises {advertised} instead of {host.advertised}"
    return ""


def host_of(uri: str) -> str:
    """Returns the host in a node's URI, or the whole text if it is not a URI."""
    try:
        return urlsplit(uri).hostname or uri
    except ValueError:
        return uri
