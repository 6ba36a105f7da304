"""Bags on the hosts of a lab, and what is in them."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from tests.e2e.lab_swarm import LabSwarm
from tests.timing import PATIENCE

FOLDER = "/var/lib/swarm-bags/newswarm"
_TYPES = get_typestore(Stores.ROS1_NOETIC)


def messages(bag: Path, topic: str = "") -> list[tuple[str, float, Any]]:
    """Topic, time of receipt and message of each that is in a bag."""
    with AnyReader([bag], default_typestore=_TYPES) as reader:
        return [
            (connection.topic, stamp / 1e9, reader.deserialize(data, connection.msgtype))
            for connection, stamp, data in reader.messages()
            if topic in ("", connection.topic)
        ]


def is_recording(swarm: LabSwarm, host: str) -> bool:
    """True once messages are on the disk: a bag without any has 4 kB."""
    return bool(swarm.shell(host, f"find {FOLDER} -name '*.active' -size +8k 2>/dev/null || true").strip())


def ended(recording: subprocess.Popen[str]) -> tuple[int, dict[str, Any]]:
    """The exit code of a `swarmctl record --json` that ends, and what it has printed by host."""
    out, err = recording.communicate(timeout=PATIENCE)
    assert "Traceback" not in err, err
    return recording.returncode, {one["host"]: one for one in json.loads(out)["hosts"]}


def forget(swarm: LabSwarm) -> None:
    """Ends what records, and removes the bags of the hosts."""
    swarm.everywhere(f"sudo systemctl stop 'swarm-recording@*'; sudo rm -rf {FOLDER}")
