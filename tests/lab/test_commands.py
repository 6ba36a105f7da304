"""The commands that a lab runs, as values: ip, mount, nspawn, systemd-run, cgroups."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.lab import paths, supervisor_client
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import network, nspawn, processes
from swarmctl.lab.hosts.nspawn import Cgroups, cgroups
from swarmctl.lab.lab_plan import Interface, LabHost
from swarmctl.lab.paths import HostPaths, LabPaths
from tests.lab.lab_values import plan_from

HOME = LabPaths(paths.DEFAULT_STATE / "lab/tiny")

HYBRID = """\
30 24 0:25 / /sys/fs/cgroup ro shared:9 - tmpfs tmpfs ro,mode=755
31 30 0:26 / /sys/fs/cgroup/systemd rw shared:10 - cgroup cgroup rw,xattr,name=systemd
32 30 0:27 / /sys/fs/cgroup/pids rw shared:11 - cgroup cgroup rw,pids
33 30 0:28 / /sys/fs/cgroup/unified rw shared:12 - cgroup2 cgroup2 rw,nsdelegate
"""
UNIFIED = """\
25 1 8:1 / / rw,relatime shared:1 - ext4 /dev/vda rw
30 24 0:25 / /sys/fs/cgroup rw,nosuid shared:9 - cgroup2 cgroup2 rw,nsdelegate
99 25 0:25 /docker/1 /var/lib/x/cgroup rw,nosuid - cgroup2 cgroup rw
"""
LEGACY = "".join(HYBRID.splitlines(keepends=True)[:3])


def test_the_networks_of_a_lab(tmp_path: Path) -> None:
    plan = plan_from(tmp_path)
    machine, operator, alpha, beta = network.batches(plan, HOME)
    assert machine.argv == ("ip", "-batch", "-")
    assert machine.lines == (
        "netns add swarm-tiny",
        "netns add swarm-tiny.alpha",
        "netns add swarm-tiny.beta",
    )
    assert operator.argv == ("ip", "-n", "swarm-tiny", "-batch", "-")
    assert operator.lines == (
        "link set lo up",
        "link add br0 type bridge forward_delay 0 mcast_snooping 0",
        "address add 10.91.1.254/24 dev br0",
        "link set br0 up",
        "link add br1 type bridge forward_delay 0 mcast_snooping 0",
        "address add 10.91.2.254/24 dev br1",
        "link set br1 up",
        "link add h0n0 type veth peer name wlan0 netns swarm-tiny.alpha",
        "link set h0n0 master br0 up",
        "link set h0n0 type bridge_slave mcast_flood off",
        "link add h0n1 type veth peer name eth0 netns swarm-tiny.alpha",
        "link set h0n1 master br1 up",
        "link add h1n0 type veth peer name wlan0 netns swarm-tiny.beta",
        "link set h1n0 master br0 up",
        "link set h1n0 type bridge_slave mcast_flood off",
        "link add h1n1 type veth peer name eth0 netns swarm-tiny.beta",
        "link set h1n1 master br1 up",
    )
    assert beta.lines == (
        "link set lo up",
        "address add 10.91.1.2/24 dev wlan0",
        "link set wlan0 up",
        "address add 10.91.2.252/24 dev eth0",
        "link set eth0 up",
    )
    assert alpha.namespace == "swarm-tiny.alpha"


def test_only_namespaces_are_created_in_the_machines_own(tmp_path: Path) -> None:
    for batch in network.batches(plan_from(tmp_path), HOME):
        if batch.namespace is None:
            assert all(line.startswith("netns add swarm-tiny") for line in batch.lines)
        assert not any("route" in line or "default" in line for line in batch.lines)


def test_ipv6_has_no_duplicate_address_detection(tmp_path: Path) -> None:
    host = LabHost("a", "fd00::1", "robot", 22, (Interface("wlan0", "air", "fd00::1/64"),))
    assert "address add fd00::1/64 dev wlan0 nodad" in tuple(network._host_lines(host))


def test_a_cable_to_a_foreign_network_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LabError, match="host alpha is not on a network `lan`") as refusal:
        network.set_cable(plan_from(tmp_path), HOME, "alpha", up=False, network="lan")
    assert refusal.value.help_lines == ("it is on air, wire",)


def test_a_host_boots_with_its_network_and_a_writable_disk(tmp_path: Path) -> None:
    place = HostPaths(Path("/lab/hosts/alpha"))
    overlay, terminals = nspawn.mount_argvs(Path("/image"), place)
    assert overlay == (
        *("mount", "-t", "overlay", "overlay", "-o"),
        "lowerdir=/image,upperdir=/lab/hosts/alpha/upper,workdir=/lab/hosts/alpha/work",
        "/lab/hosts/alpha/root",
    )
    assert "gid=20" in terminals[5]
    assert "mode=0660" in terminals[5]
    argv = nspawn.nspawn_argv(plan_from(tmp_path).hosts[0], place, Path("/run/netns/swarm-tiny.alpha"))
    assert argv[0] == "systemd-nspawn"
    assert {
        "--boot", "--register=no", "--keep-unit", "--hostname=alpha", "--capability=CAP_NET_ADMIN",
        "--network-namespace-path=/run/netns/swarm-tiny.alpha", "--bind=/lab/hosts/alpha/pts:/run/lab-pts",
    } <= set(argv)  # fmt: skip


def test_a_host_with_containers_keeps_them_on_a_disk_of_their_own(tmp_path: Path) -> None:
    host, place = plan_from(tmp_path).hosts[0], HostPaths(Path("/lab/hosts/alpha"))
    plain = nspawn.nspawn_argv(host, place, Path("/run/netns/x"))
    assert set(nspawn.nspawn_argv(host, place, Path("/run/netns/x"), None, ("podman",))) - set(plain) == {
        "--bind=/lab/hosts/alpha/containers:/var/lib/containers"
    }  # fmt: skip
    assert nspawn.nspawn_argv(host, place, Path("/run/netns/x"), None, ("docker",)) == plain


def test_a_host_joins_its_cgroups_before_it_starts() -> None:
    found = nspawn.in_cgroups(("true", "a b"), (Path("/x"), Path("/y z")))
    assert found[:4] == ("sh", "-c", 'echo $$ > "$0/cgroup.procs" && exec "$@"', "/y z")
    assert found[4:8] == ("sh", "-c", 'echo $$ > "$0/cgroup.procs" && exec "$@"', "/x")
    assert found[8:] == ("true", "a b")


@pytest.mark.parametrize(
    ("mounts", "own", "delegated", "expected"),
    [
        (
            HYBRID, "1:name=systemd:/\n8:pids:/\n0::/", False,
            Cgroups(Path("/sys/fs/cgroup/unified/t"), Path("/sys/fs/cgroup/systemd/t")),
        ),
        (
            HYBRID, "1:name=systemd:/system.slice/l.service\n0::/system.slice/l.service", True,
            Cgroups(
                Path("/sys/fs/cgroup/unified/system.slice/l.service/t"),
                Path("/sys/fs/cgroup/systemd/system.slice/l.service/t"),
            ),
        ),
        (UNIFIED, "0::/a.slice/l.service", True, Cgroups(Path("/sys/fs/cgroup/a.slice/l.service/t"), None)),
        (UNIFIED, "0::/", False, Cgroups(Path("/sys/fs/cgroup/t"), None)),
        (UNIFIED, "0::/user.slice/u.scope", False, Cgroups(Path("/sys/fs/cgroup/t"), None)),
        (LEGACY, "1:name=systemd:/x\n8:pids:/", False, Cgroups(None, Path("/sys/fs/cgroup/systemd/t"))),
        ("", "0::/", False, Cgroups(None, None)),
    ],
    ids=["hybrid", "hybrid-systemd", "unified-systemd", "unified", "unified-session", "legacy", "none"],
)  # fmt: skip
def test_cgroups_of_a_lab(mounts: str, own: str, delegated: bool, expected: Cgroups) -> None:
    found = cgroups(mounts, own, "t", delegated=delegated)
    assert found == expected
    assert nspawn.nspawn_environment(found) == (
        {"SYSTEMD_NSPAWN_UNIFIED_HIERARCHY": "1"} if expected.unified else {}
    )


def test_under_systemd_the_supervisor_is_a_delegated_service() -> None:
    place = LabPaths(Path("/elsewhere/lab/tiny"))
    argv = supervisor_client.service_argv(place, ("supervisor", "x"))
    assert argv[:3] == ("systemd-run", "--quiet", "--collect")
    assert {"--property=Delegate=yes", "--property=KillSignal=SIGKILL"} <= set(argv)
    assert f"--unit={supervisor_client.service(place)}" in argv
    assert "@" not in supervisor_client.service(place)  # it would be the instance of a template
    assert argv[-2:] == ("supervisor", "x")


def test_isolated_processes_end_with_the_first_one() -> None:
    argv = processes.isolated(("a", "b"))
    assert argv[0] == "unshare"
    assert {"--mount", "--pid", "--fork", "--kill-child", "--mount-proc"} <= set(argv)
    assert argv[-2:] == ("a", "b")


def test_missing_programs_are_reported_with_their_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes.os, "geteuid", lambda: 0)
    monkeypatch.setattr(processes, "SEARCH_PATH", "/nowhere")
    with pytest.raises(LabError, match="systemd-nspawn is not found") as refusal:
        processes.require("systemd-nspawn")
    assert refusal.value.help_lines == ("apt-get install systemd-container",)


def test_a_lab_needs_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes.os, "geteuid", lambda: 1000)
    with pytest.raises(LabError, match="needs root"):
        processes.require("true")


def test_every_required_program_has_a_package() -> None:
    assert {"ip", "mmdebstrap", "mount", "setpriv", "ssh", "ssh-keygen", "systemd-nspawn", "unshare"} <= set(
        processes.PACKAGES
    )


def test_labs_of_two_state_folders_share_no_name(monkeypatch: pytest.MonkeyPatch) -> None:
    tags = set()
    for state in ("", "/a", "/b"):
        monkeypatch.setenv(paths.STATE_VARIABLE, state)
        place = paths.lab_paths("tiny")
        tags |= {place.tag, place.namespace("h")}
    assert len(tags) == 6
    assert "swarm-tiny" in tags


@pytest.mark.parametrize(
    "name", ["", ".", "..", "/etc", "a/b", "a.b", "../x", "-a", "A", "a b", "a\n", "x" * 64]
)
def test_no_name_leaves_the_folder_of_labs(name: str) -> None:
    with pytest.raises(LabError, match="cannot be the name of a lab"):
        paths.lab_paths(name)
