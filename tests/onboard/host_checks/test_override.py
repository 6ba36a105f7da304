from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.override import judge, observe

from tests.onboard.host_checks.hosts import program, with_unit

UNIT = "swarm-new.k3.service"
TEXT = """\
[Service]
Type=notify
ExecStart=/usr/bin/driver
ExecStopPost=/usr/bin/stop_motors
Restart=always
WatchdogSec=1
DynamicUser=yes
NoNewPrivileges=yes
ProtectHome=yes
ProtectSystem=strict
DeviceAllow=char-ttyUSB rw
DeviceAllow=char-ttyACM rw
SystemCallFilter=@system-service
SystemCallFilter=~@privileged
"""
LINK = f"/etc/systemd/system/{UNIT}"
SITE = f"{LINK}.d/site.conf"


def host(folder: Path, monkeypatch: pytest.MonkeyPatch, drop_in: str | None = None, **shown: str) -> Home:
    """A host with one unit; its systemctl shows a drop-in with this text, and ``shown``."""
    home = with_unit(folder, UNIT, TEXT.encode(), {LINK: f"units/{UNIT}"})
    (folder / SITE[1:]).parent.mkdir(parents=True)
    (folder / LINK[1:]).symlink_to(f"{home.current_link}/units/{UNIT}")
    (folder / SITE[1:]).write_text(drop_in or "")
    values = {
        "Id": UNIT,
        "FragmentPath": LINK,
        "DropInPaths": SITE if drop_in else "",
        "NeedDaemonReload": "no",
        "LoadState": "loaded",
        **shown,
    }
    printed = "".join(f"{key}={value}\n" for key, value in values.items())
    program(folder, monkeypatch, "systemctl", f"cat <<X\n{printed}X")
    return home


@pytest.mark.parametrize(
    ("drop_in", "keys"),
    [
        ("[Service]\nRestart=no\nExecStopPost=\n", "Restart=no ExecStopPost="),
        ("[Service]\nExecStopPost=\nExecStopPost=/bin/true\n", "ExecStopPost=/bin/true"),
        ("[Service]\nWatchdogSec=0\n", "WatchdogSec=0"),
        ("[Service]\n User = root\nNoNewPrivileges=no\n", "User=root NoNewPrivileges=no"),
        ("[Service]\nProtectSystem=no\nMemoryMax=1G\n", "ProtectSystem=no"),
        ("[Service]\nProtectHome=read-only\n", "ProtectHome=read-only"),
        ("[Unit]\nStartLimitIntervalSec=1h\n", "StartLimitIntervalSec=1h"),
        ("[Service]\nExecStart=\nExecStart=/bin/sleep \\\n  600\n", "ExecStart=/bin/sleep    600"),
        ("[Unit]\nConditionPathExists=/none\n", "ConditionPathExists=/none"),
        ("[Service]\nWatchdogSec=1min\n", "WatchdogSec=1min"),
        ("[Service]\nWatchdogSec=1d\n", "WatchdogSec=1d"),
        ("[Service]\nDeviceAllow=/dev/mem rw\n", "DeviceAllow=/dev/mem rw"),
        ("[Service]\nSystemCallFilter=@privileged\n", "SystemCallFilter=@privileged"),
    ],
)
def test_a_drop_in_against_safety_or_isolation_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, drop_in: str, keys: str
) -> None:
    (seen,) = observe(host(tmp_path, monkeypatch, drop_in))
    found = judge(seen, "pi")
    assert (found.state, found.message, found.about) == ("bad", f"{SITE} has {keys}", UNIT)
    assert f"sudo systemctl restart {UNIT}" in found.hint


@pytest.mark.parametrize(
    "drop_in",
    [
        None,
        "[Service]\nEnvironment=A=b\nMemoryMax=1G\nNice=5\nLimitNOFILE=4096\n",
        "[Service]\nProtectHome=tmpfs\nBindReadOnlyPaths=/home/robot/catkin_ws\n",
        "[Service]\nRestart=always\nNoNewPrivileges=true\nWatchdogSec=1\n",
        "[Service]\nWatchdogSec=1s\n",
        "[Service]\nWatchdogSec=0.5 s 500ms\n",
        "[Service]\nExecStart=\nExecStart=/usr/bin/driver\n",
        "[Service]\nDeviceAllow=char-ttyACM rw\n",
        "# Restart=no\n; WatchdogSec=0\n",
    ],
)
def test_a_drop_in_that_changes_neither_is_free(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, drop_in: str | None
) -> None:
    (seen,) = observe(host(tmp_path, monkeypatch, drop_in))
    assert judge(seen, "pi").state == "ok"


@pytest.mark.parametrize(
    ("shown", "message"),
    [
        ({"LoadState": "masked"}, "it is masked"),
        ({"FragmentPath": f"/run/systemd/transient/{UNIT}"}, f"has read /run/systemd/transient/{UNIT}"),
        ({"NeedDaemonReload": "yes"}, "has read another text than its files have now"),
        ({"DropInPaths": SITE}, f"{SITE} cannot be read"),
    ],
)
def test_a_unit_that_systemd_has_from_elsewhere_is_bad(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shown: dict[str, str], message: str
) -> None:
    home = host(tmp_path, monkeypatch, **shown)
    (tmp_path / SITE[1:]).unlink()
    (seen,) = observe(home)
    found = judge(seen, "pi")
    assert (found.state, message in found.message) == ("bad", True)


def test_a_unit_that_is_not_there_is_for_another_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert observe(host(tmp_path, monkeypatch, LoadState="not-found")) == []
