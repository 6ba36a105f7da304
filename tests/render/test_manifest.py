"""The bytes of ``manifest.json``: their digest names the release, so they never change for the same data."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from swarmctl.render.manifest import manifest_bytes

DATA = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.text()),
    lambda inside: st.one_of(
        st.lists(inside, max_size=4), st.dictionaries(st.text(max_size=5), inside, max_size=4)
    ),
    max_leaves=10,
)


@given(st.dictionaries(st.text(), DATA))
def test_it_is_indented_json_with_sorted_keys(manifest: Any) -> None:
    assert manifest_bytes(manifest).decode() == json.dumps(manifest, indent=1, sort_keys=True) + "\n"
