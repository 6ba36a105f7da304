"""Where a swarm is on a host, and which daemon reads what. Shared by the agent and swarmctl."""

from __future__ import annotations

#: Each swarm has a folder here, and the agent its own (loader.py).
ROOT = "/opt/swarm"
AGENT_FOLDER = ROOT + "/.agent"
#: What a host keeps of its swarms beside their releases: secrets and latches of `swarmctl stop`.
KEPT = "/etc/swarm"
#: The bags of each swarm, which stay when it is removed.
BAGS = "/var/lib/swarm-bags"
#: The records of who commanded the robots of each swarm; the StateDirectory of their units, which stays, too.
COMMANDS = "/var/lib/swarm-commands"
#: The files of trials that go on, one for each unit that runs in trials alone; gone after a boot.
TRIALS = "/run/swarm-trials"

LINK_FOLDERS = ("/etc/systemd/system", "/etc/udev/rules.d", "/etc/NetworkManager/conf.d")
BLOCK_FILES = ("/etc/hosts", "/etc/chrony/chrony.conf")
#: Of programs that a host may lack: without that folder or file nothing is written there, nor reported.
OF_PROGRAMS = ("/etc/NetworkManager/conf.d", "/etc/chrony/chrony.conf")

#: Which daemon reads the files below a folder.
READERS = {
    "systemd": "/etc/systemd/",
    "udev": "/etc/udev/",
    "chrony": "/etc/chrony/",
    "NetworkManager": "/etc/NetworkManager/",
}


def stop_file(swarm: str, robot: str) -> str:
    """Returns the latch of a robot: while the file exists, the robot stands."""
    return f"{KEPT}/{swarm}/stopped/{robot}"


def trial_file(unit: str) -> str:
    """Returns the file that exists while a unit that runs in trials alone may run."""
    return f"{TRIALS}/{unit}"
