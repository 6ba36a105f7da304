"""Which publishers a relay brings: never what another relay has brought, and none of its messages twice."""

from __future__ import annotations

import pytest
from swarm_onboard.domain_relay.publishers import (
    Names,
    Publisher,
    Quality,
    Unnamed,
    named,
    of_island,
    quality,
    relays,
)

OWN, RELAY = b"participant1" + b"\0\0\1\3", b"participant2" + b"\0\0\1\3"
JOYSTICK = Publisher(OWN, "/joystick", reliable=True, latched=False)
BROUGHT = Publisher(RELAY[:12] + b"\0\0\7\3", "/planner", reliable=True, latched=False)


def test_what_a_relay_has_brought_goes_no_further() -> None:
    """Its nodes have the names of others, and are known by their participant."""
    brought = relays([(OWN, "/k3/driver"), (RELAY, "/multimaster_k3_pi")])
    assert of_island([JOYSTICK, BROUGHT], brought) == [JOYSTICK]
    assert of_island([JOYSTICK, BROUGHT], relays([(OWN, "/k3/driver")])) == [JOYSTICK, BROUGHT]


@pytest.mark.parametrize(
    ("offers", "requested"),
    [
        ([(True, True), (True, True)], (True, True)),
        ([(True, True), (True, False)], (True, False)),
        ([(True, False), (False, False)], (False, False)),
        ([(False, True)], (False, True)),
    ],
)
def test_a_subscription_requests_what_all_publishers_offer(
    offers: list[tuple[bool, bool]], requested: tuple[bool, bool]
) -> None:
    assert quality(Publisher(OWN, "/a", *one) for one in offers) == Quality(*requested)


@pytest.mark.parametrize("name", ["", "joystick", "/a b", "/a//b", "/1st", "/" + "n" * 300, "/a\n", "/é"])
def test_no_node_gets_a_name_that_ros_refuses(name: str) -> None:
    """It would end the relay."""
    assert named([JOYSTICK, Publisher(b"other", name, True, False)], ()) == {OWN: "/joystick"}


def test_a_flood_of_nodes_drives_out_none_that_was_there() -> None:
    flood = [Publisher(b"%d" % number, f"/a{number}", True, False) for number in range(1000)]
    found = named([*flood, JOYSTICK], {"/joystick"})
    assert found[OWN] == "/joystick"
    assert len(found) == 64


def test_a_publisher_found_again_without_a_name_has_the_one_it_had() -> None:
    names = Names()
    assert names.of(OWN, "") == ""
    assert [names.of(OWN, "/joystick"), names.of(OWN, "")] == ["/joystick", "/joystick"]


def test_a_flood_of_publishers_drives_out_no_name_that_is_in_use() -> None:
    names = Names()
    names.of(OWN, "/joystick")
    for number in range(100_000):
        names.of(b"%d" % number, f"/a{number}")
        found = names.of(OWN, "")
    assert found == "/joystick"
    assert names.of(b"0", "") == ""


def test_the_last_message_of_a_node_without_a_name_waits_for_it() -> None:
    unnamed = Unnamed()
    unnamed.keep(OWN, b"map 1")
    unnamed.keep(OWN, b"map 2")
    assert unnamed.taken(OWN) == [b"map 2"]
    assert unnamed.taken(OWN) == []


def test_few_publishers_without_a_name_are_waited_for() -> None:
    unnamed = Unnamed()
    for number in range(100):
        unnamed.keep(bytes([number]), b"x" * 10)
    assert len([one for one in range(100) if unnamed.taken(bytes([one]))]) == 8


def test_a_publisher_that_has_gone_is_forgotten() -> None:
    unnamed = Unnamed()
    unnamed.keep(OWN, b"map")
    unnamed.forget_others([RELAY])
    assert unnamed.taken(OWN) == []
