"""The image of a container: the host has it, and it is built for the host's machine. Pure."""

from __future__ import annotations

from dataclasses import replace

from swarm_onboard.agent.images import Image

from swarmctl.health.verdict import State, Verdict, bad
from swarmctl.spec.program_model import Container

#: By the machine of a host (uname(2)), the architectures of images that run on it, as Go names them.
_RUNS = {
    "x86_64": ("amd64", "386"),
    "i686": ("386",),
    "aarch64": ("arm64", "arm"),
    "armv8l": ("arm",),
    "armv7l": ("arm",),
    "armv6l": ("arm",),
}


def problem(container: Container, host: str, seen: Image | None, unit: Verdict) -> Verdict | None:
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
