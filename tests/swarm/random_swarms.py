"""Random swarms in each mode: all names resolve, but networks may not connect the hosts."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from hypothesis import strategies as st

from swarmctl.spec.catalog import Catalog, load_catalog
from swarmctl.spec.load import load_text
from swarmctl.swarm.index import SwarmIndex

Data = dict[str, Any]
MODES = ("single-minded", "leader", "central", "standalone", "combined")


@st.composite
def swarms(draw: st.DrawFn) -> Data:
    """A spec as plain data: all its names resolve, but rules may report errors."""
    hosts = [f"h{number}" for number in range(draw(st.integers(1, 4)))]
    robots = [f"r{number}" for number in range(draw(st.integers(1, 4)))]
    mode = draw(st.sampled_from(MODES))
    host = st.sampled_from(hosts)
    data: Data = {"version": 1, "name": "random", "mode": mode}
    if mode in ("single-minded", "leader"):
        data["leader"] = draw(host)
    if mode == "central":
        data["hub"] = draw(host)
    if mode == "combined":
        data["islands"] = _islands(draw, hosts)
    if mode in ("combined", "standalone"):
        data["multimaster"] = {"provider": draw(st.sampled_from(("fkie", "static")))}
    data["hosts"] = {
        name: {"address": f"10.0.0.{number + 1}", "bluetooth": ["hci0"]} for number, name in enumerate(hosts)
    }
    data["robots"] = {
        name: {
            "type": "epuck",
            "host": data["leader"] if mode == "single-minded" else draw(host),
            "optional": draw(st.booleans()),
        }
        for name in robots
    }
    data["links"] = [
        {
            "kind": "wlan",
            "name": f"n{number}",
            "hosts": draw(st.lists(host, min_size=1, max_size=4, unique=True)),
        }
        for number in range(draw(st.integers(0, 3)))
    ] + [_line(draw, number, name, one["host"]) for number, (name, one) in enumerate(data["robots"].items())]
    data["programs"] = {
        f"p{number}": _program(draw, host, robots) for number in range(draw(st.integers(0, 3)))
    }
    commander = st.sampled_from([*data["programs"], *hosts, *robots])
    data["control"] = [
        {"by": draw(commander), "of": draw(st.lists(st.sampled_from(robots), min_size=1, unique=True))}
        for _ in range(draw(st.integers(0, 3)))
    ]
    return data


def index_of(data: Data) -> SwarmIndex:
    """The index of a spec given as plain data."""
    document, found = load_text(json.dumps(data), "random.yaml", _catalog())
    assert document is not None, found
    return SwarmIndex(document)


@cache
def _catalog() -> Catalog:
    return load_catalog()


def _islands(draw: st.DrawFn, hosts: list[str]) -> Data:
    cut = draw(st.integers(0, len(hosts) - 1))
    groups = [group for group in (hosts[:cut], hosts[cut:]) if group]
    return {
        f"i{number}": {"mode": "central", "hosts": group, "hub": draw(st.sampled_from(group))}
        for number, group in enumerate(groups)
    }


def _line(draw: st.DrawFn, number: int, robot: str, host: str) -> Data:
    if draw(st.booleans()):
        return {"kind": "serial", "host": host, "robot": robot, "usb": {"serial": f"A{number}"}}
    return {"kind": "bluetooth", "host": host, "robot": robot, "mac": f"10:00:00:00:00:{number:02d}"}


def _program(draw: st.DrawFn, host: st.SearchStrategy[str], robots: list[str]) -> Data:
    topics = st.lists(
        st.sampled_from(["/map", "/goal", *(f"/{robot}/odom" for robot in robots)]), max_size=2, unique=True
    )
    own = [{"topic": one, "type": "nav_msgs/Odometry"} for one in draw(topics) if not one.endswith("/odom")]
    subscribed = [{"topic": one, "type": "nav_msgs/Odometry"} for one in draw(topics)]
    return {
        "host": draw(host),
        "package": "demo",
        "executable": "x",
        "publishes": own,
        "subscribes": subscribed,
    }
