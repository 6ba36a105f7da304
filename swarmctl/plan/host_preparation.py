"""What makes a host fit for its part of the swarm: what it needs against what it has, as steps. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from swarm_onboard.agent.verbs.inventory import Answer

from swarmctl.plan.host_needs import Entries, HostNeeds, PackageRequirement, install_hints
from swarmctl.plan.plan import Problem
from swarmctl.plan.preflight import unusable
from swarmctl.render.bundle import required
from swarmctl.render.middleware import middleware_of

if TYPE_CHECKING:
    pass


class Kind(str, Enum):
    """What a step does, in the order of execution; the values are those of the agent's ``prepare``.

    ``COMPILE`` comes after all hosts are fit (see ``host_builds``).
    """

    ACCOUNT = "account"
    KEYS = "keys"
    SUDO = "sudo"
    GROUP = "group"
    SOURCE = "source"
    REFRESH = "refresh"
    APT = "apt"
    PIP = "pip"
    PULL = "pull"
    BUILD = "build"
    COMPILE = "compile"


@dataclass(frozen=True)
class Step:
    """One action on a target, with its cause: the entries of the spec that need it."""

    kind: Kind
    target: str
    cause: str

    def to_json(self) -> dict[str, Any]:
        """Returns the step in ``prepare --json``."""
        return asdict(self) | {"kind": self.kind.value}


@dataclass(frozen=True)
class HostPreparation:
    """The steps that make one host fit. ``lacks``: what no step can provide, each with how a person can.

    ``problem``: why the host can be neither looked at nor prepared; ``platform``: as its agent reports it;
    ``notes``: what a person sets on its robots.
    """

    host: str
    steps: tuple[Step, ...] = ()
    lacks: tuple[Problem, ...] = ()
    problem: Problem | None = None
    platform: str = ""
    notes: tuple[str, ...] = ()

    @property
    def fit(self) -> bool:
        """True if nothing is left to do."""
        return not (self.steps or self.lacks or self.problem)

    def targets(self, kind: Kind) -> list[str]:
        """Returns the targets of the steps of this kind."""
        return [step.target for step in self.steps if step.kind is kind]

    def to_json(self) -> dict[str, Any]:
        """Returns the host's entry in ``prepare --json``."""
        return {
            "host": self.host,
            "fit": self.fit,
            "steps": [step.to_json() for step in self.steps],
            "lacks": [asdict(one) for one in self.lacks],
            "notes": list(self.notes),
            "problem": asdict(self.problem) if self.problem else None,
        }


def preparation(
    needs: HostNeeds, has: Answer, *, login: str = "", refreshed: bool = False
) -> HostPreparation:
    """The steps from what the host ``has`` to what it ``needs``; none if it is fit.

    ``login``: the account whose keys a new account takes over, if it is not the one of the spec;
    ``refreshed``: the lists of packages are fresh, so what apt does not know does not exist.
    """
    if problem := unusable(has.facts):
        return HostPreparation(needs.host, problem=problem)
    steps = [*_account(needs, has, login), *_groups(needs, has)]
    lacks: list[Problem] = []
    unknown: list[PackageRequirement] = []
    for need in (found for one in needs.packages for found in _resolved(one, has)):
        if _missing(need, has) and _has_use(need, has):
            chosen = next((name for name in need.packages if has.debian.get(name) == "available"), None)
            if chosen is None and need.packages and not refreshed:
                unknown.append(need)
            elif chosen is None:
                lacks.append(_no_source(need, has, needs.distro))
            elif chosen not in (step.target for step in steps):
                steps.append(Step(Kind.APT, chosen, _cause(need.entries)))
    if unknown:
        names = ", ".join(dict.fromkeys(need.packages[0] for need in unknown))
        source = middleware_of(needs.distro).package_source(has.facts.platform)
        of_ros = any(name.startswith("ros-") for need in unknown for name in need.packages)
        if source and of_ros and source not in has.sources:
            steps.append(Step(Kind.SOURCE, source, "the packages of ROS are there, signed by its key"))
        steps.append(Step(Kind.REFRESH, "lists of packages", f"apt does not know {names} yet"))
    steps += [Step(Kind.PIP, one, _cause(who)) for one, who in needs.pip.items() if not _has_pip(one, has)]
    for one in (*_images(needs, has), *_workspaces(needs, has)):
        (steps if isinstance(one, Step) else lacks).append(one)  # type: ignore[arg-type]
    order = list(Kind)
    return HostPreparation(
        needs.host,
        tuple(sorted(steps, key=lambda step: order.index(step.kind))),
        tuple(lacks),
        platform=has.facts.platform,
        notes=needs.by_hand,
    )


def _account(needs: HostNeeds, has: Answer, login: str) -> Iterator[Step]:
    account, cause = has.account, f"hosts.{needs.host}.user"
    if not account.exists:
        yield Step(Kind.ACCOUNT, needs.account, cause)
    if not account.keys and login not in ("", needs.account):
        yield Step(Kind.KEYS, needs.account, f"those of {login}")
    if not account.sudo:
        yield Step(Kind.SUDO, needs.account, "a deploy writes units")


def _groups(needs: HostNeeds, has: Answer) -> Iterator[Step]:
    member = has.account.groups
    for group, who in needs.groups.items():
        if group not in has.groups or (group not in member and needs.account != "root"):
            yield Step(Kind.GROUP, group, _cause(who))


def _images(needs: HostNeeds, has: Answer) -> Iterator[Step | Problem]:
    """Yields what is done about images that are not there; an engine that is installed first has none."""
    there = {key for key, seen in zip(needs.images, has.images, strict=False) if seen.there}
    for (engine, image), who in needs.images.items():
        if (engine, image) in there:
            continue
        if "@" in image:
            yield Step(Kind.PULL, f"{engine} {image}", _cause(who))
        else:
            copy = f"copy it: `{engine} save {image} | ssh {needs.host} sudo {engine} load`"
            yield Problem("lacks", f"the image {image}, needed by {_cause(who)}", copy)


def _workspaces(needs: HostNeeds, has: Answer) -> Iterator[Step | Problem]:
    for path, who in needs.workspaces.items():
        state = has.workspaces.get(path)
        if state == "sources":
            yield Step(Kind.BUILD, path, f"{_cause(who)}: its sources are not built")
        elif state == "absent":
            hint = f"copy it there, with its sources in {path}/src"
            yield Problem("lacks", f"the workspace {path}", hint)


def _has_use(need: PackageRequirement, has: Answer) -> bool:
    """False for ``iw`` on a host without a radio: a cable connects it to the access point."""
    return need.requirement != "iw" or bool(has.wireless)


def _resolved(need: PackageRequirement, has: Answer) -> Iterator[PackageRequirement]:
    """What a rosdep key means on this host: by its rosdep, or the first candidate that its apt knows."""
    if not need.key:
        yield need
    elif not has.facts.has.get(need.requirement):
        by_rosdep = has.rosdep.get(need.key)
        known = [one for one in need.packages if has.debian.get(one) in ("installed", "available")]
        if by_rosdep is not None:
            yield from (PackageRequirement("", (one,), need.entries, need.key) for one in by_rosdep)
        elif not need.requirement:  # a key of the table; all of its packages
            yield from (PackageRequirement("", (one,), need.entries, need.key) for one in need.packages)
        elif known:
            yield PackageRequirement("", (known[0],), need.entries, need.key)
        else:
            yield need


def _missing(need: PackageRequirement, has: Answer) -> bool:
    if need.requirement:
        return not has.facts.has.get(need.requirement)
    return has.debian.get(need.packages[0]) != "installed"


def _no_source(need: PackageRequirement, has: Answer, distro: str) -> Problem:
    """The problem that no package source of the host has it, or that the installed package does not."""
    what = (
        f"{need.key or required(need.requirement)[1] or need.packages[0]}, needed by {_cause(need.entries)}"
    )
    if not need.packages:
        return Problem("lacks", what, "; ".join(install_hints(distro, [need.requirement])))
    installed = [name for name in need.packages if has.debian.get(name) == "installed"]
    reason = (
        f"{installed[0]} is installed and does not bring it"
        if installed
        else (f"no package source of the host has {' or '.join(need.packages)}")
    )
    if need.key:
        entry = need.entries[0]
        hint = (
            "add a package source that has it to the host; if the package runs without it, "
            f"add `skip_keys: [{need.key}]` to {entry}"
        )
        return Problem("lacks", f"{what}; {reason}", hint)
    return Problem(
        "lacks",
        f"{what}; {reason}",
        "add a package source that has it to the host (docs/hosts.md), or build it in the workspace that "
        "`ros.workspace` names",
    )


def _has_pip(requirement: str, has: Answer) -> bool:
    installed, version = has.pip.get(requirement), requirement.partition("==")[2]
    return installed is not None and version in ("", installed)


def _cause(entries: Entries) -> str:
    return ", ".join(entries) or "the swarm"
