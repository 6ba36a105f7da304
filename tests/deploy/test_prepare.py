"""``swarmctl prepare`` on hosts that are folders: the real agent, a stand-in for apt and the accounts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from swarmctl.deploy.prepare import Prepared, observe, prepare
from swarmctl.plan.host_needs import HostNeeds, PackageRequirement
from swarmctl.remote import parallel_hosts
from swarmctl.remote.transport import HostError, Kind, Session, Target
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession

HOSTS = ("k3", "epuck")
# debian/NAME.source: apt knows it; .new: after an update; .installed: it is there. Its text lies at `brings`.
APT_CACHE = r"""#!/bin/sh
shift; D=$SWARM_PREFIX/debian
for name; do
  [ -e $D/$name.source ] || [ -e $D/$name.installed ] || { echo "N: Unable to locate $name" >&2; continue; }
  echo "$name:"
  [ -e $D/$name.installed ] && echo "  Installed: 1.0" || echo "  Installed: (none)"
  echo "  Candidate: 1.0"; echo "  Version table:"
done
"""
APT_GET = r"""#!/bin/sh
D=$SWARM_PREFIX/debian; echo "$*" >> $SWARM_PREFIX/apt
case "$*" in
*update*) for one in $D/*.new; do [ -e $one ] && mv $one ${one%.new}.source; done; exit 0 ;;
esac
while [ "$1" != -- ]; do shift; done; shift
for name; do
  [ -e $D/$name.broken ] && { echo "E: Sub-process /usr/bin/dpkg returned an error code (1)"; exit 100; }
  echo "Setting up $name (1.0) ..."; touch $D/$name.installed
  [ "$name" = ros-noetic-joy ] || continue
  mkdir -p $SWARM_PREFIX/opt/ros/noetic/share/joy; touch $SWARM_PREFIX/opt/ros/noetic/share/joy/package.xml
done
"""
ACCOUNTS = r"""#!/bin/sh
A=$SWARM_PREFIX/accounts; name=$(basename $0); for last; do :; done
case "$name $1" in
"getent passwd") [ -e $A/$2 ] && echo "$2:x:1000:1000::/home/$2:/bin/bash" ;;
"getent group") [ -e $A/group-$2 ] && echo "$2:x:20:" ;;
"id -nG") cat $A/$2 ;;
"id "*) exec /usr/bin/id "$@" ;;
useradd*) echo "$last" > $A/$last; mkdir -p $SWARM_PREFIX/home/$last ;;
groupadd*) touch $A/group-$last ;;
usermod*) echo "$2" >> $A/$3 ;;
visudo*) ;;
"sudo -n") shift
  [ "$1" = -l ] || exec "$@"
  ls $SWARM_PREFIX/etc/sudoers.d/*-$3 > /dev/null 2>&1 && echo "    (ALL) NOPASSWD: ALL" ;;
esac
"""
SCRIPTS = {"apt-cache": APT_CACHE, "apt-get": APT_GET} | dict.fromkeys(
    ("getent", "id", "useradd", "groupadd", "usermod", "visudo", "sudo"), ACCOUNTS
)


@dataclass
class FolderTransport:
    hosts: Mapping[str, FakeHost]
    logins: list[str]

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        self.logins.append(target.user)
        if target.host not in self.hosts:
            raise HostError(Kind.UNREACHABLE, "no route")
        yield LocalSession(self.hosts[target.host].environment())


@pytest.fixture
def hosts(tmp_path: Path) -> dict[str, FakeHost]:
    return {name: fresh(tmp_path / name) for name in HOSTS}


def fresh(folder: Path) -> FakeHost:
    """A host with an account `pi`, and a package source that has chrony; that with joy is not read yet."""
    host = FakeHost(folder)
    for name, text in SCRIPTS.items():
        script = folder / "bin" / name
        script.write_text(text)
        script.chmod(0o755)
    for path in (
        "debian/chrony.source",
        "debian/ros-noetic-joy.new",
        "accounts/pi",
        "accounts/group-dialout",
    ):
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).touch()
    for path in ("etc/sudoers.d", "home/pi/.ssh"):
        (folder / path).mkdir(parents=True)
    (folder / "home/pi/.ssh/authorized_keys").write_text("ssh-ed25519 AAAA me@laptop\n")
    return host


def needs(host: str, *more: PackageRequirement) -> HostNeeds:
    joy = PackageRequirement("package:joy", ("ros-noetic-joy", "python3-joy"), ("programs.joystick",))
    extra = PackageRequirement("", ("chrony",), ("hosts.k3.install",))
    return HostNeeds("lab", host, "robot", "noetic", (joy, extra, *more), groups={"dialout": ("robots.k3",)})


TARGETS = {name: Target(name, "192.0.2.1", "robot") for name in HOSTS}


def run(
    hosts: Mapping[str, FakeHost], *more: PackageRequirement
) -> tuple[dict[str, Prepared | HostError], list[str]]:
    """The result by host, and the notes on progress of all."""
    wanted = {name: needs(name, *(more if name == "k3" else ())) for name in HOSTS}
    results: dict[str, Prepared | HostError] = {}
    notes = []
    for event in prepare(wanted, TARGETS, FolderTransport(hosts, []), login="pi", parallel=4):
        if isinstance(event, parallel_hosts.Note):
            notes.append(f"{event.host}: {event.text}")
        elif isinstance(event, parallel_hosts.Finished):
            results[event.host] = event.outcome
    return results, notes


def changed(results: Mapping[str, Prepared | HostError]) -> dict[str, bool | str]:
    return {name: one.message if isinstance(one, HostError) else one.changed for name, one in results.items()}


def test_a_fresh_host_is_made_fit_and_then_left_alone(hosts: dict[str, FakeHost]) -> None:
    results, notes = run(hosts)
    assert changed(results) == dict.fromkeys(HOSTS, True)
    k3 = results["k3"]
    assert isinstance(k3, Prepared)
    done = [f"{step.kind.value} {step.target}" for step in k3.steps]
    assert done == [
        "refresh lists of packages", "account robot", "keys robot", "sudo robot", "group dialout",
        "apt ros-noetic-joy", "apt chrony",
    ]  # fmt: skip
    assert "k3: setting up ros-noetic-joy" in notes
    host = hosts["k3"]
    assert host.read("home/robot/.ssh/authorized_keys") == b"ssh-ed25519 AAAA me@laptop\n"
    assert (host.prefix / "home/robot/.ssh/authorized_keys").stat().st_mode & 0o777 == 0o600
    assert host.outside()["sudoers.d/90-swarm-robot"] == "robot ALL=(ALL) NOPASSWD: ALL\n"

    (host.prefix / "apt").unlink()
    assert changed(run(hosts)[0]) == dict.fromkeys(HOSTS, False)
    assert not (host.prefix / "apt").exists()


def test_a_plan_changes_nothing(hosts: dict[str, FakeHost]) -> None:
    wanted = {name: needs(name) for name in HOSTS}
    logins: list[str] = []
    seen = observe(wanted, TARGETS, FolderTransport(hosts, logins), login="pi", parallel=4)
    assert [host.fit for host in seen] == [False, False]
    assert logins == ["pi", "pi"]
    assert not (hosts["k3"].prefix / "apt").exists()
    assert not (hosts["k3"].prefix / "accounts/robot").exists()


def test_what_nobody_has_costs_only_its_host(hosts: dict[str, FakeHost]) -> None:
    found = changed(
        run(hosts, PackageRequirement("package:rare", ("ros-noetic-rare",), ("programs.rare",)))[0]
    )
    assert found["epuck"] is True
    assert "no package source of the host has ros-noetic-rare" in str(found["k3"])
    assert (hosts["k3"].prefix / "debian/chrony.installed").exists()  # what it can have, it has


def test_a_failed_installation_shows_what_apt_prints(hosts: dict[str, FakeHost]) -> None:
    (hosts["k3"].prefix / "debian/chrony.broken").touch()
    found = changed(run(hosts)[0])
    assert found["epuck"] is True
    assert "apt-get install ros-noetic-joy chrony failed" in str(found["k3"])
    assert "dpkg returned an error code" in str(found["k3"])


def test_a_host_out_of_reach_costs_only_itself(hosts: dict[str, FakeHost]) -> None:
    del hosts["epuck"]
    found = changed(run(hosts)[0])
    assert found == {"k3": True, "epuck": "no route"}
