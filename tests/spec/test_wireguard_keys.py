"""The file of pinned WireGuard keys: what is pinned is read again, and nothing else in it is lost."""

from __future__ import annotations

import base64

from hypothesis import given
from hypothesis import strategies as st

from swarmctl.spec.wireguard_keys import parse, pinned

KEYS = st.binary(min_size=32, max_size=32).map(lambda key: base64.b64encode(key).decode())
PINS = st.dictionaries(st.from_regex(r"[a-z][a-z0-9-]{0,20}", fullmatch=True), KEYS, max_size=4)


@given(before=PINS, new=PINS)
def test_a_new_key_takes_the_place_of_the_old_one(before: dict[str, str], new: dict[str, str]) -> None:
    content = pinned(b"# of the lab on the third floor\n", before)
    after = pinned(content, new)
    assert parse(after) == {**before, **new}
    assert after.startswith(b"# of the lab on the third floor\n")
    assert len(after.splitlines()) == 1 + len({*before, *new})


@given(content=st.binary(max_size=200), new=PINS)
def test_other_lines_stay(content: bytes, new: dict[str, str]) -> None:
    others = [
        one
        for one in content.decode(errors="surrogateescape").splitlines()
        if not parse(one.encode(errors="surrogateescape"))
    ]
    after = pinned(content, new).decode(errors="surrogateescape").splitlines()
    assert [one for one in after if one in others] == others


def test_a_damaged_line_pins_nothing() -> None:
    key = base64.b64encode(bytes(32)).decode()
    for line in (f"k3-pi {key[:-1]}", f"k3-pi {key}x", f"K3 {key}", f"k3-pi  # {key}", key):
        assert parse(line.encode()) == {}
