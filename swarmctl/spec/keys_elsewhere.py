"""Keys that people write where a spec says the same elsewhere, by section, each with that place. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from swarmctl.yamltext.source import Loc

_IN_SSH_CONFIG = "write `IdentityFile` in ~/.ssh/config, or add the key to ssh-agent"
_ISLAND = "an island lists its hosts: `islands: {NAME: {mode: ..., hosts: [...]}}`"
_GROUP = "a group lists its members, `groups: {NAME: [...]}`; `labels` are words to select by"
_LINE = "how a robot is connected is an entry of `links`: {kind: serial, host: HOST, robot: NAME, ...}"
_CONTROL = "`control` says who commands which robots: {by: NAME, of: [...], priority: 1}"
_JOYSTICK = "for a gamepad write `use: teleop-joy`, for a keyboard `use: teleop-key`"
_RESTART = "leave it out: every program is started again when it ends, unless its `lifecycle` says otherwise"
_TOPICS = "`publishes` and `subscribes` list its topics, each with its type"
_BRIDGE = "`multimaster: {topics: [...]}` has topics to bridge; those of `control` and of programs are found"
_SHARED = {
    **dict.fromkeys(("island", "islands"), _ISLAND),
    **dict.fromkeys(("group", "groups", "tag", "tags"), _GROUP),
}
PLACES: Mapping[str, Mapping[str, str]] = {
    "hosts": {
        **_SHARED,
        "password": "swarmctl logs in with SSH keys only; `ssh-copy-id` puts yours on the host",
        **dict.fromkeys(("key", "key_file", "ssh_key", "identity_file", "private_key"), _IN_SSH_CONFIG),
    },
    "robots": {
        **_SHARED,
        **dict.fromkeys(("port", "device", "baud", "serial", "usb", "mac", "pin", "link", "links"), _LINE),
        **dict.fromkeys(("address", "ip", "uri"), _LINE.replace("serial", "udp")),
        **dict.fromkeys(("commander", "commanders", "control", "controlled_by", "priority"), _CONTROL),
    },
    "programs": {
        **_SHARED,
        **dict.fromkeys(("teleop", "joystick", "gamepad", "joy"), _JOYSTICK),
        **dict.fromkeys(("drives", "controls", "commands", "of", "control", "priority"), _CONTROL),
        **dict.fromkeys(("respawn", "restart", "required"), _RESTART),
        **dict.fromkeys(("topic", "topics"), _TOPICS),
        "name": "leave it out: its name is the key in front of it",
    },
    "": dict.fromkeys(("bridge", "bridges", "relay"), _BRIDGE),
}


def place_of(tagged: Loc) -> str:
    """Returns where a spec says what an unknown key means; empty if that is not known.

    ``tagged``: the place of the key, such as ``("hosts", "pi", "island")`` or ``("bridges",)``.
    """
    section = {1: "", 3: str(tagged[0])}.get(len(tagged))
    return "" if section is None else PLACES.get(section, {}).get(str(tagged[-1]), "")
