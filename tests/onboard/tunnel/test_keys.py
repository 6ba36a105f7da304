"""The public keys that a host knows: added and retired, never taken back, in whatever order they arrive."""

from __future__ import annotations

import base64

from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.tunnel.keys import Keys, is_key, joined, line, lines_of, news

KEYS = st.binary(min_size=32, max_size=32).map(lambda key: base64.b64encode(key).decode())
KEY = base64.b64encode(bytes(32)).decode()
NAMES = st.sampled_from(["k3-pi", "koala-laptop", "pi-1"])
FEW = st.sampled_from([base64.b64encode(bytes([one]) * 32).decode() for one in range(3)])
TEXTS = st.lists(st.builds(line, NAMES, FEW, retired=st.booleans()), max_size=8).map("".join)


def state(text: str) -> tuple[object, object]:
    """What counts of a text, without the order of keys."""
    keys = Keys(text)
    return tuple({host: set(own) for host, own in one.items()} for one in (keys.live, keys.retired))  # type: ignore[return-value]


@given(TEXTS, TEXTS, TEXTS)
def test_the_order_of_joining_does_not_matter(one: str, two: str, three: str) -> None:
    together = state(joined(joined(one, two), three))
    assert together == state(joined(one, joined(three, two))) == state(joined(joined(three, two), one))
    assert joined(joined(one, two), two) == joined(one, two)


@given(TEXTS, TEXTS)
def test_a_retired_key_never_comes_back(before: str, more: str) -> None:
    retired = {key for own in Keys(before).retired.values() for key in own}
    after = Keys(joined(before, more))
    assert not retired & {key for own in after.live.values() for key in own}


@given(TEXTS, TEXTS)
def test_news_are_the_hosts_whose_keys_change(before: str, more: str) -> None:
    old, new = state(before), state(joined(before, more))
    changed = {
        host
        for host in ("k3-pi", "koala-laptop", "pi-1")
        if any(one.get(host) != other.get(host) for one, other in zip(old, new, strict=True))  # type: ignore[attr-defined]
    }
    assert set(news(before, more)) == changed


@given(st.text(max_size=200), TEXTS)
def test_other_lines_stay(text: str, more: str) -> None:
    others = [one for one in text.splitlines() if not any((Keys(one).live, Keys(one).retired))]
    after = joined(text, more).splitlines()
    assert [one for one in after if one in others] == others


def test_the_order_is_that_of_the_lines() -> None:
    first, second = (base64.b64encode(bytes([one]) * 32).decode() for one in (9, 1))
    text = joined(line("k3-pi", first), line("k3-pi", second) + line("pi-1", KEY, retired=True))
    assert (Keys(text).live, Keys(text).retired) == ({"k3-pi": (first, second)}, {"pi-1": (KEY,)})
    assert joined(text, line("k3-pi", first, retired=True)).splitlines() == [
        f"k3-pi {first} retired", f"k3-pi {second}", f"pi-1 {KEY} retired",
    ]  # fmt: skip
    assert lines_of(text, ["koala-laptop"]) == line("pi-1", KEY, retired=True)


def test_a_damaged_line_has_no_key() -> None:
    for text in ("k3-pi {}x", "K3 {}", "k3-pi  # {}", "{}", "k3-pi {} old", "k3-pi {} {}"):
        keys = Keys(text.format(KEY, KEY))
        assert (keys.live, keys.retired) == ({}, {})


@given(KEYS)
def test_a_key_is_32_bytes_in_base64(key: str) -> None:
    assert is_key(key)
    of_its_length = (key[:42] + "V=", key[:42] + "==", "ä" + key[1:], "A" * 44)
    for wrong in ("", key[:-1], f"{key}=", f"{key}\n", *of_its_length):
        assert not is_key(wrong)
