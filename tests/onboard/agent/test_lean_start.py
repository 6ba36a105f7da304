"""The agent starts without the modules that take longest to load; what replaces them does the same."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from swarm_onboard.agent import json_text
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.texts import is_name

from tests.onboard.agent.fakehost import BOOT, FakeHost, bundle
from tests.timing import PATIENCE

SLOW = {"typing", "json", "glob", "inspect", "dataclasses", "ctypes", "tarfile", "urllib"}
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


def loaded(host: FakeHost, request: object) -> set[str]:
    """The top-level modules that one request loads."""
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-X", "importtime", "-c", BOOT],
        input=json.dumps(request).encode() + b"\n",
        capture_output=True,
        env=host.environment(),
        timeout=PATIENCE,
        check=True,
    )
    assert b"swarm_onboard.agent.rpc" in done.stderr
    return {line.rpartition(b"|")[2].strip().decode().partition(".")[0] for line in done.stderr.splitlines()}


@pytest.mark.parametrize(
    "request_",
    [{"verb": "observe"}, {"verb": "stop", "robots": ["koala"], "others": False, "who": "me", "patience": 0}],
    ids=["observe", "stop"],
)
def test_the_most_frequent_requests_load_no_slow_module(tmp_path: Path, request_: dict[str, object]) -> None:
    host = FakeHost(tmp_path)
    new = {"swarm": "new", **request_}
    assert not loaded(host, new) & {*SLOW, "re", "subprocess"}
    assert not host.apply(bundle("1")).error
    assert not loaded(host, new) & SLOW  # the module subprocess, for systemctl, loads `re` by itself


@given(VALUES, st.booleans())
def test_values_become_the_same_text_as_by_json(value: object, sort: bool) -> None:
    text = json_text.dumps(value, sort_keys=sort)
    assert text == json.dumps(value, sort_keys=sort, separators=(",", ":"))
    assert repr(json_text.loads(f" {text}\r\n")) == repr(json.loads(text))


@given(st.text('{}[]:,"\\ \n\t0123456789.-+eEtruefalsnNIiy\u00a0'))
@example('{"a" 1}')
@example('["')
@example('"\n')
@example("1 2")
@example("")
@example("\u00a01")
def test_texts_are_refused_as_by_json(text: str) -> None:
    try:
        wanted = repr(json.loads(text))
    except ValueError as error:
        with pytest.raises(ValueError, match=re.escape(str(error).partition(":")[0])):
            json_text.loads(text)
    else:
        assert repr(json_text.loads(text)) == wanted


@pytest.mark.parametrize("value", [{1, 2}, b"bytes", object()])
def test_what_has_no_form_in_json_is_an_error(value: object) -> None:
    with pytest.raises(TypeError):
        json_text.dumps([value])


@given(st.text("abzAZ019_.-\u00e9\u0660\n", max_size=5) | st.integers())
def test_names_are_those_of_the_pattern(value: object) -> None:
    pattern = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,2}"
    assert is_name(value, "_.-", 3) is (isinstance(value, str) and re.fullmatch(pattern, value) is not None)


class Point(NamedTuple):
    """A point."""

    x: int
    y: int = 7

    @property
    def sum(self) -> int:
        return self.x + self.y


def test_a_named_tuple_has_fields_defaults_and_methods() -> None:
    point = Point(1)
    assert (point, point.sum, point._replace(y=2).sum, Point._fields) == ((1, 7), 8, 3, ("x", "y"))
    assert (repr(point), Point.__doc__, Point.__module__) == ("Point(x=1, y=7)", "A point.", __name__)
