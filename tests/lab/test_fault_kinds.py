"""The kinds of faults: their options, and the commands that they run."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.lab import paths
from swarmctl.lab.faults import host_faults, robot_faults
from swarmctl.lab.faults.kinds import KINDS
from swarmctl.lab.hosts import inside
from swarmctl.lab.paths import LabPaths
from tests import ROOT
from tests.lab.lab_values import plan_from

HOME = LabPaths(paths.DEFAULT_STATE / "lab/tiny")
PAGE = (ROOT / "docs/lab.md").read_text("utf-8")


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_is_in_the_table_of_the_page(name: str) -> None:
    kind = KINDS[name]
    option = ""
    if kind.option is not None:
        option = f" --{kind.option.name}" if kind.option.needed else f" [--{kind.option.name} "
    assert f"| `{name} {'ROBOT' if kind.of_robots else 'HOST'}...{option}" in PAGE


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("loss", "5", 5.0), ("loss", "0.5", 0.5), ("loss", "100", 100.0), ("bandwidth", "1Mbit", "1Mbit"),
        ("bandwidth", "0.5Mbit/s", "0.5Mbit"), ("clock", "-1.5", -1.5), ("link-down", "lab", "lab"),
        ("battery", "5", 5.0),
    ],
)  # fmt: skip
def test_values_of_options(name: str, text: str, value: object) -> None:
    assert KINDS[name].read(text) == value


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("loss", "0"), ("loss", "0.01"), ("loss", "101"), ("loss", "5%"), ("bandwidth", "1"),
        ("bandwidth", "0kbit"), ("clock", "0"), ("clock", "now"),
    ],
)  # fmt: skip
def test_wrong_values_of_options(name: str, text: str) -> None:
    option = KINDS[name].option
    assert option is not None
    with pytest.raises(ValueError, match=rf"^--{option.name} `{text}`: write "):
        KINDS[name].read(text)


def test_lost_packets() -> None:
    assert host_faults.loss_script(2.5) == (
        "nft -f - <<'END'\n"
        "table inet lab_loss\n"
        "delete table inet lab_loss\n"
        "table inet lab_loss {\n"
        "  chain input {\n"
        "    type filter hook input priority -300\n"
        '    iif != "lo" numgen random mod 100000 <= 2499 drop\n'
        "  }\n"
        "  chain output {\n"
        "    type filter hook output priority -300\n"
        '    oif != "lo" numgen random mod 100000 <= 2499 drop\n'
        "  }\n"
        "}\n"
        "END"
    )


def test_multicast_is_lost_but_neighbours_are_found() -> None:
    script = host_faults.no_multicast_script()
    neighbours, lost = script.index("ff02::1:ff00:0/104 } accept"), script.index("ip6 daddr ff00::/8 drop")
    assert neighbours < lost
    assert 'oif != "lo" ip daddr 224.0.0.0/4 drop' in script


def test_both_ends_of_each_cable_have_the_bandwidth(tmp_path: Path) -> None:
    argvs = [" ".join(one) for one in host_faults.rate_argvs(plan_from(tmp_path), HOME, "beta", "1Mbit")]
    assert argvs == [
        f"tc -n {namespace} qdisc replace dev {device} root tbf rate 1Mbit burst 8kb latency 400ms"
        for namespace, device in (
            ("swarm-tiny", "h1n0"),
            ("swarm-tiny.beta", "wlan0"),
            ("swarm-tiny", "h1n1"),
            ("swarm-tiny.beta", "eth0"),
        )
    ]
    unlimited = host_faults.rate_argvs(plan_from(tmp_path), HOME, "beta", None)
    assert {one[8:] for one in unlimited} == {("noqueue",)}


def test_a_step_of_the_clock_takes_the_last_one_back() -> None:
    first, second = host_faults.clock_script(-0.5).splitlines()
    assert first == host_faults.END_OF_CLOCK
    assert "lambda: now() + -0.5)(time.time)" in second
    assert "lambda: now() + -500000000)(time.time_ns)" in second


@pytest.mark.parametrize("script", [host_faults.full_script(), host_faults.read_only_script()])
def test_a_fault_of_the_disk_takes_the_last_one_back(script: str) -> None:
    assert script.splitlines()[:2] == ["set -e", host_faults.END_OF_MOUNT]


def test_commands_of_units() -> None:
    assert host_faults.REBOOT_SCRIPT == "systemctl --no-block reboot"
    assert robot_faults.kill_script("tiny", "rover").endswith("--kill-who=main swarm-tiny.rover.service")


def test_a_script_runs_in_the_namespaces_of_a_host_or_of_the_operator() -> None:
    inside_host = inside.argv(7, "true")
    assert inside_host[:2] == ("nsenter", "--target=7")
    assert {"--mount", "--net", "--pid", "--root"} < set(inside_host)
    assert inside_host[-3:] == ("/bin/sh", "-c", "true")
    assert inside.argv_as_operator(HOME, "true")[:2] == ("nsenter", "--net=/run/netns/swarm-tiny")
