"""Whatever an index has, it is read or refused with one printable line."""

from __future__ import annotations

import copy
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.capsule.capsule_index import INDEX, CapsuleError, Index
from swarmctl.capsule.folder import problems, read, write
from swarmctl.views import capsule as view
from tests.capsule.trial_folder import ABOUT, filled

RAW = {
    "empty": b"",
    "no JSON": b"\xff\xfe{",
    "deep": b"[" * 100_000,
    "a huge number": b'{"v": 1' + b"0" * 100_000 + b"}",
    "a list": b"[]",
    "endless text": b'{"v": 1, "swarm": "' + b"x" * 100_000 + b'"}',
}


MORE = {
    "parameters": {"wander": {"places": {"start": ["door", "left"]}}},
    "success": False,
    "judged": [{"topic": "k3/odom", "condition": "distance", "wanted": 1, "found": 0.4, "met": False}],
    "hosts": {
        "k3-pi": {
            **ABOUT["hosts"]["k3-pi"],
            "devices": [
                {"vendor": "0403", "product": "6001", "name": "", "serial": "A1", "ports": ["/dev/ttyUSB0"]}
            ],
            "packages": {"joy": "1.15.1"},
        }
    },
}


@pytest.fixture(scope="module")
def index() -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        write(filled(Path(folder)), ABOUT | MORE)
        made: dict[str, Any] = json.loads((Path(folder) / INDEX).read_text("utf-8"))
        return made


def refused(folder: Path, data: bytes) -> str:
    (folder / INDEX).write_bytes(data)
    with pytest.raises(CapsuleError) as caught:
        read(folder)
    assert str(caught.value).isprintable()
    assert caught.value.help
    return str(caught.value)


@pytest.mark.parametrize("data", RAW.values(), ids=RAW)
def test_what_is_no_index_is_refused(tmp_path: Path, data: bytes) -> None:
    assert len(refused(tmp_path, data)) < 1000


def test_a_truncated_index_is_refused(tmp_path: Path, index: dict[str, Any]) -> None:
    data = json.dumps(index).encode()
    for end in range(0, len(data), 7):
        refused(tmp_path, data[:end])


RIGHT = (
    *((True, one) for one in ("changed", "v", "success", "met", "executable")),
    *(([], one) for one in ("judged", "devices", "ports")),
    (-1, "ahead"),
)
VALUES = ([], True, -1, 1e300)  # of a parameter


def places(value: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in inner:
        yield (*above, key)
        yield from places(one, (*above, key))


@pytest.mark.parametrize(
    "wrong", [[], {"\x1b[2J": "\x07"}, "\x1b]0;x\x07", True, -1, 1e300, float("nan"), "\ud800"]
)
def test_a_wrong_value_is_refused_everywhere(tmp_path: Path, index: dict[str, Any], wrong: object) -> None:
    for place in places(index):
        if (wrong, place[-1]) in RIGHT or (place[0] == "parameters" and place[2:] and wrong in VALUES):
            continue
        data = copy.deepcopy(index)
        inside = data
        for key in place[:-1]:
            inside = inside[key]
        inside[place[-1]] = wrong
        refused(tmp_path, json.dumps(data).encode())


def test_a_name_with_control_characters_is_refused(tmp_path: Path, index: dict[str, Any]) -> None:
    for section in ("hosts", "robots"):
        (one,) = index[section].values()
        message = refused(tmp_path, json.dumps(index | {section: {"a\x1b[2J": one}}).encode())
        assert f"{section}.a" in message


def shown(folder: Path) -> str:
    try:
        view.trials([read(folder)], {})
        return "; ".join(problems(folder))
    except CapsuleError as error:
        return str(error)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from(sorted(Index.model_fields)), JSON, max_size=4))
def test_any_index_is_shown_or_refused(index: dict[str, Any], changes: dict[str, Any]) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = filled(Path(name))
        (folder / INDEX).write_text(json.dumps(index | changes), "utf-8")
        assert shown(folder).isprintable()
