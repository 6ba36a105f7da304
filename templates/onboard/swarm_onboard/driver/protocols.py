"""The protocol of a line as frozen values: text lines, bytes, a user's class, or rosserial."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Mapping, Pattern, Union

from swarm_onboard.common.parameters import between, positive


@dataclass(frozen=True)
class LineQuery:
    """A request, and its reply: a head, ``values`` numbers, up to ``extra`` numbers that are ignored."""

    send: str
    reply: str
    values: int = 0
    extra: int = 0
    pattern: Pattern[str] | None = None


@dataclass(frozen=True)
class Stray:
    """A line that begins with ``begins`` reports a fault, unless it begins with one of ``unless``."""

    begins: str
    means: str
    unless: tuple[str, ...] = ()


@dataclass(frozen=True)
class LineProtocol:
    """Requests and replies as lines of text. ``identify`` is answered with text."""

    reply_timeout: float
    terminator: str
    error_heads: tuple[str, ...]
    strays: tuple[Stray, ...]
    identify: LineQuery | None
    setup: tuple[LineQuery, ...]
    set_speed: LineQuery
    queries: Mapping[str, LineQuery]
    separator: str = ","  # of the head and the numbers of a reply; a blank or a tab: any number of these


@dataclass(frozen=True)
class BinaryQuery:
    """A request in hexadecimal digits with places; its reply's layout, and the numbers it ``begins`` with."""

    send: str
    reply: str
    begins: tuple[int, ...] = ()
    echo: bool = False


@dataclass(frozen=True)
class BinaryProtocol:
    """Requests and replies as bytes."""

    reply_timeout: float
    byte_order: str
    identify: LineQuery | None
    setup: tuple[BinaryQuery, ...]
    set_speed: BinaryQuery
    queries: Mapping[str, BinaryQuery]


@dataclass(frozen=True)
class PythonProtocol:
    """The class ``codec`` in the file ``module``. ``values``: how many numbers each query's reply makes."""

    reply_timeout: float
    module: Path
    codec: str
    options: Mapping[str, Any]
    identify: bool
    values: Mapping[str, int]


@dataclass(frozen=True)
class Ticks:
    """The topics of a sketch that count how far the wheels have turned. ``wheel_radius`` in metres."""

    left: str
    right: str
    counts_per_turn: float
    wheel_radius: float


@dataclass(frozen=True)
class RosserialProtocol:
    """The topics a sketch should announce: types by topic, and rates, Hz.

    ``firmware``: its digest; empty: any.
    """

    firmware_timeout: float
    firmware: str
    publishes: Mapping[str, str]
    subscribes: Mapping[str, str]
    rates: Mapping[str, float]
    ticks: Ticks | None


Protocol = Union[LineProtocol, BinaryProtocol, PythonProtocol, RosserialProtocol]


def protocol_of(data: Mapping[str, Any], folder: Path, wheel_radius: Any) -> Protocol:
    """Returns the protocol that ``data`` describes; files named there are relative to ``folder``.

    Raises ``ValueError``, ``KeyError`` or ``TypeError`` if ``data`` is not what swarmctl writes.
    """
    if data["kind"] == "rosserial":
        return _sketch(data, wheel_radius)
    timeout = between("protocol.reply_timeout", data["reply_timeout"], 0.01, 2.0)
    if data["kind"] == "line":
        return LineProtocol(
            reply_timeout=timeout,
            terminator=str(data["terminator"]),
            error_heads=tuple(str(head) for head in data["error_heads"]),
            strays=tuple(Stray(**{**one, "unless": tuple(one["unless"])}) for one in data["strays"]),
            identify=LineQuery(**data["identify"]) if "identify" in data else None,
            setup=tuple(LineQuery(**one) for one in data["setup"]),
            set_speed=_line_query(data["set_speed"]),
            queries={name: _line_query(one) for name, one in data["queries"].items()},
            separator=str(data["separator"]),
        )
    if data["kind"] == "binary":
        return BinaryProtocol(
            reply_timeout=timeout,
            byte_order=str(data["byte_order"]),
            identify=LineQuery(**data["identify"]) if "identify" in data else None,
            setup=tuple(_binary_query(one) for one in data["setup"]),
            set_speed=_binary_query(data["set_speed"]),
            queries={name: _binary_query(one) for name, one in data["queries"].items()},
        )
    if data["kind"] == "python":
        return PythonProtocol(
            reply_timeout=timeout,
            module=folder / str(data["module"]),
            codec=str(data["codec"]),
            options=dict(data["options"]),
            identify=bool(data["identify"]),
            values={str(name): int(one["values"]) for name, one in data["queries"].items()},
        )
    raise ValueError("this driver speaks lines of text, bytes or rosserial, not `{}`".format(data["kind"]))


def _sketch(data: Mapping[str, Any], wheel_radius: Any) -> RosserialProtocol:
    ticks = data.get("odometry")
    return RosserialProtocol(
        firmware_timeout=positive("protocol.firmware_timeout", data["firmware_timeout"]),
        firmware=str(data.get("digest", "")),
        publishes={str(one["topic"]): str(one["type"]) for one in data["publishes"]},
        subscribes={str(one["topic"]): str(one["type"]) for one in data["subscribes"]},
        rates={str(one["topic"]): positive("rate", one["rate"]) for one in data["publishes"]},
        ticks=None
        if ticks is None
        else Ticks(
            left=str(ticks["left"]),
            right=str(ticks["right"]),
            counts_per_turn=positive("counts_per_turn", ticks["counts_per_turn"]),
            wheel_radius=positive("wheel_radius", wheel_radius),
        ),
    )


def _binary_query(data: Mapping[str, Any]) -> BinaryQuery:
    return BinaryQuery(**{**data, "begins": tuple(int(one) for one in data.get("begins", ()))})


def _line_query(data: Mapping[str, Any]) -> LineQuery:
    pattern = {"pattern": re.compile(data["pattern"], re.ASCII)} if "pattern" in data else {}
    return LineQuery(**{**data, **pattern})
