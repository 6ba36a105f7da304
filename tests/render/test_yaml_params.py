"""Parameter files: equal robots share their text, and the quick writer writes what PyYAML writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from validate import EACH, spec_of

from swarmctl.render import plain_yaml, yaml_params
from swarmctl.render.build_bundle import bundles
from tests.loading import load_swarm

WORDS = st.sampled_from(
    ["a", "odom", "yes", "On", "null", "", "K-Team Koala", "/bot_1/scan", "../urdf/x.urdf", "10.0.0.1", "1.5",
     "<Fixed Frame>", "Size (m)", "deg(90)", "it's", "a: b", "a #b", "é", "a\nb", "ab " * 30, "word" * 30,
     "=", "<<"]
)  # fmt: skip
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), WORDS, st.text(max_size=12)
)
KEYS = st.one_of(WORDS, st.text(min_size=1, max_size=8))
PLAIN = st.sampled_from(["odom", "K-Team Koala", "/bot_1/odom", "Size (m)", "word" * 5, True, None, 7, 0.25])
NAMES = st.sampled_from(["name", "Robot Description", "a", "topic" * 6])


def data_of(scalars: st.SearchStrategy[Any], keys: st.SearchStrategy[str]) -> st.SearchStrategy[Any]:
    def grown(inside: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
        mappings = st.dictionaries(keys, inside, max_size=12)
        return st.one_of(st.lists(inside, max_size=25), mappings, st.tuples(inside, inside))

    return st.recursive(scalars, grown, max_leaves=40)


def by_pyyaml(data: dict[str, Any]) -> str:
    text: str = yaml.dump(
        data, Dumper=yaml_params._Dumper, sort_keys=False, default_flow_style=None, width=110,
        allow_unicode=True,
    )  # fmt: skip
    return text


@given(st.dictionaries(KEYS, data_of(SCALARS, KEYS) | data_of(PLAIN, NAMES), min_size=1, max_size=6))
def test_it_is_what_pyyaml_writes(data: dict[str, Any]) -> None:
    text = yaml_params.params_file(data).decode()
    assert text.partition("\n")[2] == by_pyyaml(data)


def test_lists_go_on_in_the_next_line_where_pyyaml_breaks_them() -> None:
    """Each number of letters before the width, in lists and mappings at several depths, written quickly."""
    for length in range(60, 120):
        row = ["x" * 9] * 9 + ["y" * (length - 50), "z", "a b"]
        data = {"k": {"row": row, "of": [[*row], {"in": dict.fromkeys("abc", "w" * (length // 3))}]}}
        try:
            text = plain_yaml.written(data)
        except plain_yaml.NotPlainError:  # words at the width: PyYAML breaks between them
            assert len(by_pyyaml(data).splitlines()) > 3
        else:
            assert text == by_pyyaml(data), length


def test_robots_alike_are_written_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their number is no work for PyYAML, which would take most of the time of a render."""
    robots, written, real = 300, [], yaml.dump

    def counted(data: Any, **more: Any) -> Any:
        written.append(data)
        return real(data, **more)

    monkeypatch.setattr(yaml, "dump", counted)
    (tmp_path / "swarm.yaml").write_text(spec_of("combined", robots))
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    assert len(bundles(swarm)) == robots / EACH
    assert len(written) < robots / 4
