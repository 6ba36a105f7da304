"""What selections mean in a swarm: hosts for hosts and robots, robots for robots and hosts."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.spec.selection import select
from swarmctl.spec.selection_candidates import (
    Candidates,
    IslandFacts,
    Kind,
    ProgramFacts,
    RobotFacts,
)
from swarmctl.yamltext.selection_text import SelectionError
from tests.timing import work_at_most

LAB = Candidates(
    hosts={"laptop": (), "pi-1": ("lab1",), "pi-2": (), "both": ()},
    robots={
        "ep-1": RobotFacts("epuck2", "pi-1"),
        "ep-2": RobotFacts("epuck2", "pi-2", ("big",)),
        "k3": RobotFacts("khepera3", "laptop"),
        "both": RobotFacts("koala", "laptop"),
    },
    programs={"joy": ProgramFacts(host="laptop"), "cam": ProgramFacts(robot="ep-2")},
    islands={"west": IslandFacts("leader", ("pi-*",)), "east": IslandFacts("central", ("laptop", "both"))},
    groups={
        "eps": ("type:epuck2",),
        "first": ("@eps", "!ep-2"),
        "turn": ("@back",),
        "back": ("ep-1", "@turn"),
    },
    mode="combined",
)


@pytest.mark.parametrize(
    ("text", "hosts", "robots"),
    [
        ("*", "laptop pi-1 pi-2 both", "ep-1 ep-2 k3 both"),
        ("ep-*", "pi-1 pi-2", "ep-1 ep-2"),
        ("ep-[1-2],k3", "laptop pi-1 pi-2", "ep-1 ep-2 k3"),
        ("both", "laptop both", "both"),
        ("host:both,host:pi-1", "pi-1 both", "ep-1"),
        ("robot:both", "laptop", "both"),
        ("laptop", "laptop", "k3 both"),
        ("!k3", "pi-1 pi-2 both", "ep-1 ep-2 both"),
        ("ep-*,!ep-1", "pi-2", "ep-2"),
        ("!ep-1,ep-1", "laptop pi-1 pi-2 both", "ep-1 ep-2 k3 both"),
        ("pi-*&!ep-2", "pi-1", "ep-1"),
        ("type:k*,type:epuck2&@big", "laptop pi-2", "ep-2 k3 both"),
        ("@first", "pi-1", "ep-1"),
        ("@lab1", "pi-1", "ep-1"),
        ("@big,@eps", "pi-1 pi-2", "ep-1 ep-2"),
        ("island:west", "pi-1 pi-2", "ep-1 ep-2"),
        ("mode:central", "laptop both", "k3 both"),
        ("program:cam", "pi-2", "ep-2"),
        ("(ep-1,k3)&!(type:epuck2,zz*)", "laptop", "k3"),
    ],
)
def test_what_a_selection_means(text: str, hosts: str, robots: str) -> None:
    assert select([text], LAB, "hosts").names == tuple(hosts.split())
    assert select([text], LAB, "robots").names == tuple(robots.split())


def test_several_selections_go_on_where_the_one_before_ends() -> None:
    assert select(["ep-*", "!ep-2", "k3"], LAB, "robots").names == ("ep-1", "k3")


def test_hosts_of_robots_are_listed_with_them() -> None:
    assert select(["ep-*,laptop"], LAB, "hosts").through == {"pi-1": ("ep-1",), "pi-2": ("ep-2",)}


@pytest.mark.parametrize(
    ("text", "message", "help_"),
    [
        ("ep-9", "there is no host or robot called `ep-9`", "did you mean `ep-1` or `ep-2`?"),
        ("joy", "there is no host or robot called `joy`", "write `program:joy`"),
        ("eps", "there is no host or robot called `eps`", "write `@eps`"),
        ("west", "there is no host or robot called `west`", "write `island:west`"),
        ("all", "there is no host or robot called `all`", "write `*` for everything"),
        ("host:k3", "there is no host called `k3`", "write `robot:k3`"),
        ("*,!ep-9", "there is no host or robot called `ep-9`", "did you mean `ep-1` or `ep-2`?"),
        ("@epz", "there is no group or label called `epz`", "did you mean `@eps`?"),
        ("type:epuk2", "there is no robot of the type `epuk2`", "did you mean `type:epuck2`?"),
        ("zz*,ep-*&k3", "`zz*,ep-*&k3` selects no robot", "`zz*` means no robot here"),
        ("@turn", "`@turn` contains itself: @turn -> @back -> @turn", "remove one of these steps"),
    ],
)
def test_errors_name_what_exists(text: str, message: str, help_: str) -> None:
    with pytest.raises(SelectionError) as caught:
        select([text], LAB, "robots")
    assert (caught.value.message, caught.value.help_lines[0]) == (message, help_)


def test_an_empty_selection_lists_what_exists() -> None:
    with pytest.raises(SelectionError) as caught:
        select(["zz*"], LAB, "hosts")
    hosts, sets = caught.value.help_lines
    assert hosts == "the hosts are: `both`, `laptop`, `pi-1`, `pi-2`"
    assert all(f"`{one}`" in sets for one in ("@eps", "@lab1", "island:west"))


WORDS = st.sampled_from(["*", "ep-*", "k3", "pi-1", "@eps", "@lab1", "island:east", "type:epuck2", "zz*"])
KINDS: st.SearchStrategy[Kind] = st.sampled_from(["hosts", "robots"])


def meant(text: str, kind: Kind) -> frozenset[str]:
    """What a selection means; also nothing."""
    try:
        return frozenset(select([text], LAB, kind).names)
    except SelectionError as error:
        if "selects no" in error.message:
            return frozenset()
        raise


@given(WORDS, WORDS, KINDS)
def test_the_laws_of_sets_hold(one: str, other: str, kind: Kind) -> None:
    everything = meant("*", kind)
    assert meant(f"{one},{other}", kind) == meant(one, kind) | meant(other, kind)
    assert meant(f"{one}&{other}", kind) == meant(one, kind) & meant(other, kind)
    assert meant(f"{one},!{other}", kind) == meant(one, kind) - meant(other, kind)
    assert meant(f"{one}&!{other}", kind) == meant(one, kind) - meant(other, kind)
    assert meant(f"!{one}", kind) == everything - meant(one, kind)
    assert meant(f"!({one},{other})", kind) == meant(f"!{one}", kind) & meant(f"!{other}", kind)
    assert meant(f"!({one}&{other})", kind) == meant(f"!{one}", kind) | meant(f"!{other}", kind)


def test_ten_thousand_robots_in_fifty_groups_take_little_work() -> None:
    swarm = Candidates(
        hosts={f"pi-{number}": (f"lab{number % 50}",) for number in range(2000)},
        robots={f"ep-{number}": RobotFacts("epuck2", f"pi-{number % 2000}") for number in range(10_000)},
        groups={f"g{number}": (f"ep-{number}*", f"@lab{number}", "!ep-1") for number in range(50)},
    )
    with work_at_most(100):
        assert len(select([f"@g{number}" for number in range(50)], swarm, "robots").names) == 9_999


def test_groups_nested_too_deep_are_an_error() -> None:
    groups = {f"g{number}": (f"@g{number + 1}",) for number in range(100)} | {"g100": ("k3",)}
    with pytest.raises(SelectionError, match="more than 16 groups are nested"):
        select(["@g0"], Candidates(robots={"k3": RobotFacts()}, groups=groups), "robots")
