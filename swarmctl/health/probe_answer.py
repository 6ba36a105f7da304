"""Parses the probe's answer into frozen values; values of a wrong type or size count as unknown."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from swarmctl.health.observations import (
    Answer,
    ChangeSeen,
    ConflictSeen,
    DeviceSeen,
    DiskSeen,
    DriftSeen,
    EndedSeen,
    ForeignNode,
    GraphSeen,
    ImageSeen,
    LatchSeen,
    LaunchedSeen,
    MasterSeen,
    MemorySeen,
    NodeSeen,
    Report,
    SenderSeen,
    SimulatedTimeSeen,
    TopicSeen,
    UnitSeen,
)

_LONGEST_TEXT = 300
_MOST = 20_000  # entries of one mapping

T = TypeVar("T")


def answer_of(data: Mapping[str, Any], received: float | None = None) -> Answer:
    """Returns the agent's answer, sizes and types checked.

    ``received``: the operator's clock when it came, s.
    """
    time = _float_or_none(data.get("time"))
    return Answer(
        release=_text(data.get("release")) or None,
        units=_each(_units(data), _unit),
        master=_master(data["master"]) if isinstance(data.get("master"), Mapping) else None,
        nodes=_each(data.get("nodes"), _node),
        launched=_each(data.get("launched"), _launched),
        conflicts={_text(unit): _each(found, _conflict) for unit, found in _items(data.get("conflicts"))},
        commanders={_text(name): _texts(found) for name, found in _items(data.get("commanders"))},
        receivers={_text(name): _texts(found) for name, found in _items(data.get("receivers"))},
        others={_text(name): _texts(found) for name, found in _items(data.get("others"))},
        peers={_text(name): _text(why) for name, why in _items(data.get("peers"))},
        graph=_graph(data["graph"]) if isinstance(data.get("graph"), Mapping) else None,
        simulated_time=_simulated_time(data.get("simulated_time")),
        senders=_each(data.get("senders"), _sender),
        devices=_each(data.get("devices"), _device),
        latches=_each(data.get("latches"), _latch),
        clock_ahead=None if time is None or received is None else time - received,
        boot_id=_text(data.get("boot_id")),
        change=_change(data["change"]) if isinstance(data.get("change"), Mapping) else None,
        drift=_drift(data["drift"]) if isinstance(data.get("drift"), Mapping) else None,
        disks=_disks(data.get("disks")),
        memory=_memory(data.get("memory")),
        busy=_float_or_none(data.get("busy")),
        temperature=_float_or_none(data.get("temperature")),
        environments={_text(unit): _texts(found) for unit, found in _items(data.get("environments"))},
        images=_each(data.get("images"), _image),
        troubles={_text(name): _text(why) for name, why in _items(data.get("troubles"))},
    )


def _units(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The state of each unit, with its history and its stopped processes."""
    histories, stopped = dict(_items(data.get("history"))), dict(_items(data.get("stopped")))
    return {
        name: {**state, **dict(_items(histories.get(name))), "stopped": stopped.get(name)}
        for name, state in _items(data.get("units"))
        if isinstance(state, Mapping)
    }


def _unit(data: Mapping[str, Any]) -> UnitSeen:
    return UnitSeen(
        load=_text(data.get("load")),
        active=_text(data.get("active")),
        sub=_text(data.get("sub")),
        result=_text(data.get("result")),
        text=_text(data.get("text")),
        pid=_count(data.get("pid")),
        restarts=_count(data.get("restarts")),
        restarted=_count(data.get("restarted")),
        skipped=data.get("skipped") is True,
        recent=_count(data.get("recent")),
        running=_float_or_none(data.get("running")) or 0.0,
        starting=_float_or_none(data.get("starting")) or 0.0,
        log=_text(data.get("log")),
        exit=_text(data.get("exit")),
        stopped=_texts(data.get("stopped")),
        unmet=_texts(data.get("unmet")),
    )


def _image(data: Mapping[str, Any]) -> ImageSeen:
    return ImageSeen(
        there=data.get("there") is True,
        built_for=_text(data.get("built_for")),
        machine=_text(data.get("machine")),
        error=_text(data.get("error")),
    )


def _master(data: Mapping[str, Any]) -> MasterSeen:
    return MasterSeen(
        reachable=data.get("reachable") is True,
        error=_text(data.get("error")),
        run_id=_text(data.get("run_id")),
        latency=_float_or_none(data.get("latency")) or 0.0,
    )


def _simulated_time(data: Any) -> SimulatedTimeSeen | None:
    used = _bool_or_none(data.get("used")) if isinstance(data, Mapping) else None
    if used is None:
        return None
    return SimulatedTimeSeen(
        used=used,
        publishers=_texts(data.get("publishers")),
        count=_count(data.get("count")),
        moved=_float_or_none(data.get("moved")),
        seconds=_float_or_none(data.get("seconds")) or 0.0,
        now=_float_or_none(data.get("now")),
        error=_text(data.get("error")),
    )


def _node(data: Mapping[str, Any]) -> NodeSeen:
    return NodeSeen(
        registered=_bool_or_none(data.get("registered")),
        alive=_bool_or_none(data.get("alive")),
        uri=_text(data.get("uri")),
        pid=_count(data.get("pid")),
        error=_text(data.get("error")),
        publishes={_text(name): _text(kind) for name, kind in _items(data.get("publishes"))},
        subscribes={_text(name): _text(kind) for name, kind in _items(data.get("subscribes"))},
        topics=_each(data.get("topics"), _topic),
        report=_report(data.get("reports")),
    )


def _topic(data: Mapping[str, Any]) -> TopicSeen:
    return TopicSeen(
        count=_count(data.get("count")),
        rate=_float_or_none(data.get("rate")),
        seconds=_float_or_none(data.get("seconds")) or 0.0,
        type=_text(data.get("type")),
        error=_text(data.get("error")),
        age=_float_or_none(data.get("age")),
    )


def _launched(data: Mapping[str, Any]) -> LaunchedSeen:
    return LaunchedSeen(
        nodes=_each(data.get("nodes"), _node),
        started=tuple(_text(name) for name, _ in _items(data.get("starts"))),
        ended=_each(data.get("ended"), _ended),
        error=_text(data.get("error")),
    )


def _ended(data: Mapping[str, Any]) -> EndedSeen:
    return EndedSeen(_text(data.get("exit")), _float_or_none(data.get("lasted")))


def _conflict(data: Mapping[str, Any]) -> ConflictSeen:
    return ConflictSeen(_count(data.get("count")), _float_or_none(data.get("ago")) or 0.0)


def _report(data: Any) -> Report | None:
    """The worst of a driver's statuses."""
    statuses = [one for one in data if isinstance(one, Mapping)] if isinstance(data, list) else []
    if not statuses:
        return None
    worst = max(statuses, key=lambda one: _count(one.get("level")))
    values = dict(_items(worst.get("values")))
    refused = values.get("refused nodes", "more")
    nodes = _text(refused).split()
    return Report(
        _count(worst.get("level")),
        _text(worst.get("message")),
        _text(values.get("commander")),
        tuple(one for one in nodes if one.startswith("/")),
        refused_all=isinstance(refused, str) and all(one.startswith("/") for one in nodes),
        strangers=_text(values.get("unauthorised senders")),
    )


def _latch(data: Mapping[str, Any]) -> LatchSeen:
    return LatchSeen(_text(data.get("who")), _float_or_none(data.get("since")) or 0.0)


def _change(data: Mapping[str, Any]) -> ChangeSeen:
    return ChangeSeen(
        state=_text(data.get("state")),
        who=_text(data.get("who")),
        left=_float_or_none(data.get("left")) or 0.0,
        error=_text(data.get("error")),
        holder=_text(data.get("holder")) or None,
    )


def _drift(data: Mapping[str, Any]) -> DriftSeen:
    files, links, blocks = (
        {_text(path): _text(what) for path, what in _items(data.get(part))}
        for part in ("files", "links", "blocks")
    )
    return DriftSeen(files, links, blocks)


def _disks(data: Any) -> tuple[DiskSeen, ...]:
    known = data[:_MOST] if isinstance(data, list) else ()
    return tuple(
        DiskSeen(
            place=_text(one.get("place")),
            used_by=_text(one.get("used_by")),
            free=_count(one.get("free")),
            size=_count(one.get("size")),
            inodes=None if one.get("inodes") is None else _count(one.get("inodes")),
            read_only=one.get("read_only") is True,
        )
        for one in known
        if isinstance(one, Mapping)
    )


def _memory(data: Any) -> MemorySeen | None:
    size = _count(data.get("size")) if isinstance(data, Mapping) else 0
    return MemorySeen(size, _count(data.get("available"))) if size else None


def _sender(data: Mapping[str, Any]) -> SenderSeen:
    publishes = {_text(name): _text(kind) for name, kind in _items(data.get("publishes"))}
    return SenderSeen(_text(data.get("host")).lower(), publishes, _text(data.get("error")))


def _graph(data: Mapping[str, Any]) -> GraphSeen:
    strangers = data.get("strangers")
    return GraphSeen(
        publishers={
            _text(topic): {_text(node): _text(uri) for node, uri in _items(found)}
            for topic, found in _items(data.get("publishers"))
        },
        types={_text(topic): _text(kind) for topic, kind in _items(data.get("types"))},
        foreign=tuple(_foreign(one) for one in strangers[:_MOST] if isinstance(one, Mapping))
        if isinstance(strangers, list)
        else (),
    )


def _foreign(data: Mapping[str, Any]) -> ForeignNode:
    node, uri = _text(data.get("node")), _text(data.get("uri"))
    return ForeignNode(node, uri, _texts(data.get("publishes")), _texts(data.get("subscribes")))


def _device(data: Mapping[str, Any]) -> DeviceSeen:
    return DeviceSeen(
        exists=data.get("exists") is True,
        is_device=data.get("is_device") is True,
        usable=data.get("usable") is True,
        resolves=_text(data.get("resolves")),
        group=_text(data.get("group")),
        mode=_count(data.get("mode")),
        nearby=_texts(data.get("nearby")),
    )


def _each(data: Any, make: Callable[[Mapping[str, Any]], T]) -> dict[str, T]:
    return {_text(name): make(value) for name, value in _items(data) if isinstance(value, Mapping)}


def _items(data: Any) -> list[tuple[Any, Any]]:
    return list(data.items())[:_MOST] if isinstance(data, Mapping) else []


def _texts(data: Any) -> tuple[str, ...]:
    return tuple(_text(one) for one in data[:_MOST]) if isinstance(data, list) else ()


def _text(value: Any) -> str:
    return value[:_LONGEST_TEXT] if isinstance(value, str) else ""


def _count(value: Any) -> int:
    return value if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 63 else 0


def _float_or_none(value: Any) -> float | None:
    """A finite number below 1e15, or None: JSON also has NaN, and integers beyond any float."""
    fits = isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e15
    return float(value) if fits else None


def _bool_or_none(value: Any) -> bool | None:
    return value if isinstance(value, bool) else None
