"""One lab of two hosts: real machines with users, networks, devices and power switches."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from swarmctl.lab import lab, paths, supervisor_client
from swarmctl.lab.errors import LabError
from swarmctl.lab.faults.kinds import KINDS
from swarmctl.lab.hosts import network
from swarmctl.lab.lab_plan import LabPlan
from tests.lab.lab_values import plan_from
from tests.lab.tiny_labs import (
    booted,
    boots_of,
    in_a_lab,
    left_of,
    machine,
    on,
    processes_in,
    quiet,
    reach,
    state_of,
    succeeds,
)
from tests.timing import PATIENCE, wait_for

ROVER = "/dev/swarm/rover"
ASK_VERSION = """
import serial, sys
port = serial.Serial("/dev/swarm/rover", 115200, timeout=3, exclusive=True)
port.write(b"B\\r")
answer = port.read_until(b"\\n")
print(answer)
sys.exit(not answer.startswith(b"b,"))
"""


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The machine as it was before the lab; the lab's state is in a folder of this module's own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(paths.STATE_VARIABLE, str(tmp_path_factory.mktemp("hosts")))
        yield machine()


@pytest.fixture(scope="module")
def plan(before: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> LabPlan:
    return plan_from(tmp_path_factory.mktemp("spec"))


@pytest.fixture(scope="module")
def tiny(plan: LabPlan) -> Iterator[str]:
    place = paths.lab_paths(plan.name)
    umask = os.umask(0o077)  # of an operator whose files are nobody else's
    with booted(plan) as name:
        yield name
    os.umask(umask)
    assert left_of(place) == []


@in_a_lab
def test_people_log_in_as_the_user_of_the_spec(tiny: str) -> None:
    assert on(tiny, "alpha", "id -un; sudo -n id -u; hostname").split() == ["robot", "0", "alpha"]
    assert on(tiny, "beta", "id -u; hostname; ss -Hltn sport = :2222 | wc -l").split()[:2] == ["0", "beta"]


@in_a_lab
def test_hosts_are_debian_with_systemd_and_ros(tiny: str) -> None:
    assert on(tiny, "alpha", "cat /proc/1/comm; systemctl is-system-running") == "systemd\nrunning"
    assert on(tiny, "alpha", "which rosmaster roslaunch; python3 -c 'import rospy, tf2_msgs, serial'")


@in_a_lab
@pytest.mark.skipif(not Path("/dev/net/tun").exists(), reason="needs /dev/net/tun")
def test_hosts_can_run_wireguard(tiny: str) -> None:
    """In user space, whatever the kernel of the machine has."""
    run = "sudo -n wireguard-go wg-try >/dev/null 2>&1 && sudo -n wg set wg-try listen-port 51820"
    shown = on(tiny, "alpha", f"{run} && sudo -n wg show wg-try listen-port; sudo -n ip link delete wg-try")
    assert shown == "51820"


@in_a_lab
def test_hosts_have_different_identities(tiny: str) -> None:
    for file in ("/etc/machine-id", "/etc/ssh/ssh_host_ed25519_key.pub", "/proc/sys/kernel/random/boot_id"):
        command = f"cat {file} 2>/dev/null || sudo -n ssh-keygen -y -f {file.removesuffix('.pub')}"
        if "boot_id" not in file:  # the kernel is shared
            assert on(tiny, "alpha", command) != on(tiny, "beta", command)


@in_a_lab
def test_hosts_reach_each_other_on_both_networks(tiny: str) -> None:
    for address in ("10.91.1.2", "10.91.2.252", "10.91.1.254"):
        reach(tiny, "alpha", address)
    reach(tiny, "beta", "10.91.1.1")


@in_a_lab
def test_no_route_leads_outside(tiny: str) -> None:
    for host in ("alpha", "beta"):
        routes = on(tiny, host, "ip -json route show table all type unicast")
        assert {one["dev"] for one in json.loads(routes)} <= {"wlan0", "eth0"}
        assert all(one["dst"].startswith(("10.91.", "fe80:")) for one in json.loads(routes))
    operator = lab.operator(tiny).namespace
    found = subprocess.run(
        ("nsenter", f"--net={operator}", "ip", "route", "get", "192.0.2.1"), capture_output=True, check=False
    )
    assert found.returncode != 0


@in_a_lab
def test_the_machine_is_unchanged(tiny: str, before: dict[str, str]) -> None:
    assert machine() == before


@in_a_lab
def test_a_robot_answers_a_user_in_group_dialout(tiny: str) -> None:
    assert on(tiny, "alpha", f"python3 -c '{ASK_VERSION}'").startswith("b'b,")
    assert not succeeds(tiny, "alpha", f"sudo -n setpriv --reuid 65534 --clear-groups head -c0 {ROVER}")


@in_a_lab
def test_a_robot_answers_a_unit_with_a_dynamic_user(tiny: str) -> None:
    unit = "sudo -n systemd-run --quiet --wait --pipe -p DynamicUser=yes -p SupplementaryGroups=dialout"
    assert on(tiny, "alpha", f"{unit} python3 -c '{ASK_VERSION}'").startswith("b'b,")


@in_a_lab
def test_an_unplugged_cable_removes_the_device(tiny: str) -> None:
    waiting = f"import serial; p = serial.Serial('{ROVER}', timeout=15); print('open', flush=True); p.read(1)"
    reader = subprocess.Popen(
        ("nsenter", f"--net={lab.operator(tiny).namespace}",
         *lab.ssh_argv(tiny, "alpha", [f'python3 -c "{waiting}"'])),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    with reader:
        assert reader.stdout is not None
        assert reader.stdout.readline() == "open\n"
        lab.unplug(tiny, "rover")
        assert reader.wait(PATIENCE) != 0, "the reader got no hangup"
    assert not succeeds(tiny, "alpha", f"test -e {ROVER} -o -L {ROVER}")
    assert lab.robots(tiny)["rover"]["plugged"] is False
    assert lab.robots(tiny)["puck"]["plugged"] is True
    lab.plug(tiny, "rover")
    on(tiny, "alpha", f"python3 -c '{ASK_VERSION}'")


@in_a_lab
def test_a_reboot_keeps_the_disk_and_the_devices(tiny: str) -> None:
    key, boots = on(tiny, "alpha", "cat /etc/machine-id; echo kept > kept"), boots_of(tiny, "alpha")
    subprocess.run(
        ("nsenter", f"--net={lab.operator(tiny).namespace}",
         *lab.ssh_argv(tiny, "alpha", ["sudo -n systemctl reboot"])),
        capture_output=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    wait_for(lambda: boots_of(tiny, "alpha") == boots + 1, complaint="alpha does not come back")
    lab.start(tiny, ["alpha"], quiet)
    assert on(tiny, "alpha", "cat kept") == "kept"
    assert on(tiny, "alpha", "cat /etc/machine-id") == key
    on(tiny, "alpha", f"python3 -c '{ASK_VERSION}'")


@in_a_lab
def test_a_host_that_powers_off_stays_off_until_it_is_started(tiny: str) -> None:
    boots = boots_of(tiny, "alpha")
    on(tiny, "alpha", "sudo -n systemctl --no-block poweroff")
    wait_for(lambda: state_of(tiny, "alpha") == "stopped", complaint="alpha does not go down")
    assert state_of(tiny, "beta") == "running", "beta went down too"
    assert boots_of(tiny, "alpha") == boots
    lab.start(tiny, ["alpha"], quiet)
    assert boots_of(tiny, "alpha") == boots + 1
    on(tiny, "alpha", "true")


@in_a_lab
def test_a_power_cut_runs_no_shutdown(tiny: str) -> None:
    on(tiny, "beta", "systemd-run --quiet -p ExecStop='touch /root/stopped' sleep 1000; sync")
    lab.kill(tiny, "beta")
    assert state_of(tiny, "beta") == "stopped"
    assert not succeeds(tiny, "alpha", "ping -c1 -W1 10.91.1.2")
    lab.kill(tiny, "beta")  # once more: harmless
    lab.start(tiny, ["beta"], quiet)
    assert not succeeds(tiny, "beta", "test -e /root/stopped")


@in_a_lab
def test_a_host_can_be_cut_off_all_networks_or_one(tiny: str) -> None:
    assert lab.cut(tiny, "beta", "wire") == ("wire",)
    reach(tiny, "alpha", "10.91.1.2")
    assert not succeeds(tiny, "alpha", "ping -c1 -W1 10.91.2.252")
    assert lab.cut(tiny, "beta") == ("air", "wire")
    assert not succeeds(tiny, "alpha", "ping -c1 -W1 10.91.1.2")
    assert [one["hosts"] for one in lab.status(tiny)["networks"]] == [{"alpha": True, "beta": False}] * 2
    notes: list[str] = []
    lab.start(tiny, ["beta"], notes.append)
    assert notes == ["host beta: running, but its network is cut"]
    lab.join(tiny, "beta")
    reach(tiny, "alpha", "10.91.1.2")
    reach(tiny, "alpha", "10.91.2.252")


@in_a_lab
def test_a_second_up_changes_nothing(tiny: str, plan: LabPlan) -> None:
    supervisor, every = supervisor_client.pids(paths.lab_paths(tiny)), lab.status(tiny)
    notes: list[str] = []
    lab.up(plan, notes.append)
    assert notes[0] == "lab tiny is up already"
    assert supervisor_client.pids(paths.lab_paths(tiny)) == supervisor
    assert lab.status(tiny) == every


@in_a_lab
def test_a_second_up_repairs_the_lab(tiny: str, plan: LabPlan) -> None:
    lab.kill(tiny, "alpha")
    lab.unplug(tiny, "rover")
    lab.cut(tiny, "beta")
    lab.up(plan, quiet)
    reach(tiny, "alpha", "10.91.1.2")
    on(tiny, "alpha", f"python3 -c '{ASK_VERSION}'")


@in_a_lab
def test_a_repair_ends_every_fault(tiny: str) -> None:
    clean = "! mountpoint -q /opt/swarm && ! sudo -n nft list ruleset | grep lab_ && ! tc qdisc | grep tbf"
    values = {"percent": "100", "rate": "1Mbit", "step": "5", "network": "wire"}
    for name, kind in KINDS.items():
        if name not in ("kill", "reboot", "power-off"):
            value = kind.read(values[kind.option.name]) if kind.option else None
            lab.fault(tiny, name, "rover" if kind.of_robots else "alpha", value)
    assert not succeeds(tiny, "beta", "ping -c1 -W1 10.91.1.1")
    lab.fault(tiny, "power-off", "beta")
    lab.repair(tiny, quiet)
    on(tiny, "alpha", f"{clean} && python3 -c '{ASK_VERSION}'")
    assert "a fault" not in on(tiny, "alpha", "cat /usr/lib/python3.*/encodings/__init__.py")
    reach(tiny, "alpha", "10.91.1.2")
    lab.repair(tiny, quiet)  # once more: harmless
    reach(tiny, "alpha", "10.91.2.252")


@in_a_lab
def test_a_lab_keeps_its_plan(tiny: str, plan: LabPlan) -> None:
    with pytest.raises(LabError, match="is up with other hosts") as refusal:
        lab.up(replace(plan, robots=()), quiet)
    assert "--name" in refusal.value.help_lines[0]


@in_a_lab
def test_two_labs_with_the_same_addresses_do_not_see_each_other(tiny: str, plan: LabPlan) -> None:
    twin = replace(plan, name="twin")
    with booted(twin):
        on("twin", "alpha", "echo twin > name")
        on(tiny, "alpha", "echo tiny > name")
        assert (on("twin", "alpha", "cat name"), on(tiny, "alpha", "cat name")) == ("twin", "tiny")
        assert on("twin", "alpha", "cat /etc/machine-id") != on(tiny, "alpha", "cat /etc/machine-id")
        assert not processes_in("twin") & processes_in(tiny)
        lab.kill("twin", "beta")
        reach(tiny, "alpha", "10.91.1.2")
        assert not succeeds("twin", "alpha", "ping -c1 -W1 10.91.1.2")
        lab.unplug("twin", "rover")
        on(tiny, "alpha", f"python3 -c '{ASK_VERSION}'")
    assert left_of(paths.lab_paths("twin")) == []
    assert state_of(tiny, "beta") == "running"


@in_a_lab
def test_wrong_names_are_errors(tiny: str) -> None:
    for wrong in (
        lambda: lab.kill(tiny, "gamma"),
        lambda: lab.cut(tiny, "alpha", "lan"),
        lambda: lab.unplug(tiny, "alpha"),
        lambda: lab.operator("nothing"),
    ):
        with pytest.raises(LabError) as refusal:
            wrong()
        assert refusal.value.help_lines


@in_a_lab
def test_entering_a_namespace_does_not_affect_other_threads(tiny: str) -> None:
    inside = network.within(
        lab.operator(tiny).namespace, lambda: Path("/proc/thread-self/net/dev").read_text()
    )
    assert "br0" in inside
    assert "br0" not in Path("/proc/thread-self/net/dev").read_text()
