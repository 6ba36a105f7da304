"""Launch files as roslaunch 1.15 evaluates them: arguments, conditions, includes, namespaces."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.ros_packages.launch_files import Launched, Refusal
from tests.ros_packages.packages import launched, package

NODE = '<node pkg="p" type="t" name="{}" />'


def file(*lines: str) -> str:
    return "\n".join(("<launch>", *lines, "</launch>"))


def kinds(found: Launched) -> list[tuple[Refusal, str]]:
    return [(one.kind, one.subject) for one in found.faults]


def names(found: Launched) -> list[str | None]:
    return [one.name for one in found.nodes]


def test_an_argument_that_is_not_declared_is_unused() -> None:
    found = launched(file('<arg name="side" default="1" />'), speed="1", side="2")
    assert kinds(found) == [(Refusal.UNUSED, "speed")]
    assert found.faults[0].known == ("side",)


def test_a_default_gives_way_to_what_is_given() -> None:
    text = file('<arg name="robot" default="k3" />', NODE.format("$(arg robot)"))
    assert (names(launched(text)), names(launched(text, robot="k4"))) == (["/k3"], ["/k4"])


def test_an_argument_of_a_group_is_not_one_of_the_file() -> None:
    found = launched(file("<group>", '<arg name="foo" default="x" />', "</group>"), foo="1")
    assert kinds(found) == [(Refusal.UNUSED, "foo")]


def test_an_argument_without_a_value_matters_where_it_is_used() -> None:
    assert kinds(launched(file('<arg name="speed" />'))) == []
    used = launched(file('<arg name="speed" />', '<param name="a" value="$(arg speed)" />'))
    assert kinds(used) == [(Refusal.MISSING, "speed")]
    assert used.faults[0].place.line == 3


def test_an_argument_with_a_value_cannot_be_given() -> None:
    assert kinds(launched(file('<arg name="a" value="1" />'), a="2")) == [(Refusal.FIXED, "a")]


def test_an_argument_that_nobody_declares_breaks_the_file() -> None:
    assert kinds(launched(file('<param name="a" value="$(arg b)" />'))) == [(Refusal.BROKEN, "b")]


@pytest.mark.parametrize("condition", ["$(eval 1 == 2)", "$(env X)", "$(optenv X false)", "$(arg unknown)"])
def test_below_an_unknown_condition_nothing_is_reported(condition: str) -> None:
    text = file(
        '<arg name="unknown" default="$(env Y)" />',
        f'<group if="{condition}">',
        '<param name="a" value="$(arg nowhere)" />',
        "<nod />",
        '<include file="$(find own)/launch/none.launch" />',
        "</group>",
    )
    assert kinds(launched(text)) == []


def test_what_is_switched_off_is_not_evaluated() -> None:
    text = file('<group unless="True">', "<nod />", "</group>", '<group if="0">', "<nod />", "</group>")
    assert kinds(launched(text)) == []
    assert kinds(launched(file('<node if="false" />', '<arg unless="1" />'))) == []
    assert names(launched(file('<group if="1">', NODE.format("a"), "</group>"))) == ["/a"]


def test_namespaces_add_up() -> None:
    text = file(
        '<arg name="robot" default="k3" />',
        '<group ns="$(arg robot)">',
        NODE.format("a"),
        '<node pkg="p" type="t" name="b" ns="inner" />',
        '<node pkg="p" type="t" name="c" ns="/global" />',
        NODE.format("$(anon d)"),
        "</group>",
        NODE.format("e"),
    )
    assert names(launched(text, ns="/fleet")) == [
        "/fleet/k3/a", "/fleet/k3/inner/b", "/global/c", None, "/fleet/e",
    ]  # fmt: skip


def test_an_include_has_arguments_of_its_own() -> None:
    other = package("other", {"launch/x.launch": file('<arg name="a" />', NODE.format("$(arg a)"))})
    text = file(
        '<arg name="a" default="outer" />',
        '<include file="$(find other)/launch/x.launch" ns="in"><arg name="a" value="$(arg a)2" /></include>',
    )
    assert names(launched(text, other)) == ["/in/outer2"]
    without = launched(file('<include file="$(find other)/launch/x.launch" />'), other)
    assert kinds(without) == [(Refusal.BROKEN, "a")]


def test_an_include_may_pass_all_arguments() -> None:
    other = package("other", {"x.launch": file('<arg name="a" />', NODE.format("$(arg a)"))})
    text = file(
        '<arg name="a" default="x" />', '<arg name="more" default="y" />',
        '<include file="$(find other)/x.launch" pass_all_args="true" />',
    )  # fmt: skip
    found = launched(text, other)
    assert (kinds(found), names(found)) == ([], ["/x"])


def test_an_argument_that_is_perhaps_passed_is_no_fault() -> None:
    other = package("other", {"x.launch": file('<arg name="a" default="1" />')})
    text = file(
        '<include file="$(find other)/x.launch">',
        '<arg name="b" value="1" if="$(optenv B 0)" />',
        "</include>",
    )
    assert kinds(launched(text, other)) == []


def test_a_file_of_a_package_that_does_not_exist() -> None:
    other = package("other", {"launch/x.launch": file()})
    for element in (
        '<include file="$(find other)/launch/y.launch" />',
        '<rosparam command="load" file="$(find other)/config/y.yaml" />',
        '<param name="a" textfile="$(find other)/y.txt" />',
    ):
        assert [kind for kind, _ in kinds(launched(file(element), other))] == [Refusal.ABSENT]
    assert kinds(launched(file('<include file="$(find elsewhere)/launch/y.launch" />'), other)) == []


def test_dirname_is_the_folder_of_the_file() -> None:
    found = launched(file('<include file="$(dirname)/none.launch" />'))
    assert kinds(found) == [(Refusal.ABSENT, "launch/none.launch")]


def test_a_file_that_includes_itself_ends() -> None:
    assert launched(file('<include file="$(find own)/launch/main.launch" />')).faults == []


def test_the_limit_ends_includes_that_double() -> None:
    twice = '<include file="$(find own)/launch/main.launch" />'
    found = launched(file(twice, twice, NODE.format("a")), limit=500)
    assert found.cost < 600


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("<launch>\n<node>\n</launch>", 3),
        ("<other />", 1),
        ("<launch>\n<arg name='a' value='$(nonsense x)' />\n</launch>", 2),
        ("<launch>\n<node pkg='p' type='t' />\n</launch>", 2),
        ("<launch>\n<group if='maybe' />\n</launch>", 2),
        ("<launch>\n<arg name='a' default='1' /><arg name='a' default='1' />\n</launch>", 2),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]>\n<launch />", 1),
    ],
)
def test_what_roslaunch_refuses_is_named_with_its_line(text: str, line: int) -> None:
    (fault,) = launched(text).faults
    assert (fault.kind, fault.place.line) == (Refusal.BROKEN, line)


@pytest.mark.parametrize(
    "text", ["<group>" * 100 + "</group>" * 100, "<node />" * 30_000, f"<{'a' * 200} />"]
)
def test_a_file_above_the_limits_is_unknown(text: str) -> None:
    assert launched(f"<launch>{text}</launch>", speed="1") == Launched(cost=(len(text) + 17) // 64)


def test_packages_below_an_unknown_condition_do_not_count() -> None:
    text = file(NODE.format("a"), '<node pkg="q" type="t" name="b" if="$(env X)" />')
    assert launched(text).packages.keys() == {"p"}


def test_remaps_hold_for_what_follows_in_their_group() -> None:
    text = file(
        NODE.format("before"),
        '<group><remap from="a" to="b" />',
        '<node pkg="p" type="t" name="in"><remap from="c" to="d" /></node>',
        "</group>",
        NODE.format("after"),
    )
    assert [one.remaps for one in launched(text).nodes] == [(), (("a", "b"), ("c", "d")), ()]


@given(
    st.recursive(
        st.sampled_from(["<arg name='a' default='$(arg b)'/>", "<node/>", "$(", "&"]),
        lambda inner: st.lists(inner, max_size=4).map(
            lambda some: f"<group if='$(arg a)'>{''.join(some)}</group>"
        ),
        max_leaves=20,
    )
)
def test_any_file_is_evaluated_or_refused(text: str) -> None:
    found = launched(file(text), a="true")
    assert all(one.place.file == "src/own/launch/main.launch" for one in found.faults)


def test_a_machine_and_a_node_on_it_have_their_values() -> None:
    text = file(
        '<arg name="a" default="10.0.0.1" />',
        '<machine name="pi" address="$(arg a)" user="$(env U)" ssh-port="23" default="true" password="" />',
        '<param name="outer" value="1" />',
        '<node pkg="p" type="t" name="n" machine="pi" args="-v">',
        '<param name="inner" type="int" value="2" />',
        "</node>",
    )
    found = launched(text)
    (machine,), (node,) = found.machines, found.nodes
    assert (machine.name, machine.address, machine.user, machine.port) == ("pi", "10.0.0.1", None, "23")
    assert (machine.is_default, machine.has_password) == (True, True)
    assert (node.machine, node.arguments) == ("pi", "-v")
    assert [(one.name, one.type) for one in node.parameters] == [("inner", "int")]


def test_an_include_that_is_not_here_is_known() -> None:
    found = launched(file('<include file="$(find elsewhere)/x.launch" />'))
    assert [(one.package, one.file, one.place.line) for one in found.includes] == [
        ("elsewhere", "x.launch", 2)
    ]
    assert list(found.files) == ["src/own/launch/main.launch"]
