"""Files of Cyclone DDS and Fast DDS: the hosts and the domain that they name."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.importing.drafts import data, draft, lab

CYCLONE = """\
<CycloneDDS xmlns="https://cdds.io/config">
  <Domain Id="7">
    <General>
      <Interfaces><NetworkInterface name="wlan0"/></Interfaces>
      <AllowMulticast>false</AllowMulticast>
    </General>
    <Discovery>
      <Peers><Peer address="192.168.77.11"/><Peer Address="192.168.77.12"/></Peers>
    </Discovery>
  </Domain>
</CycloneDDS>
"""
FAST = """\
<dds>
  <profiles>
    <participant profile_name="client" is_default_profile="true"><rtps>
      <builtin><discovery_config>
        <discoveryProtocol>CLIENT</discoveryProtocol>
        <discoveryServersList><locator><udpv4>
          <address>192.168.77.11</address><port>11811</port>
        </udpv4></locator></discoveryServersList>
      </discovery_config></builtin>
    </rtps></participant>
  </profiles>
</dds>
"""


@pytest.mark.parametrize("way", ["file", "inline"])
def test_peers_of_cyclone_are_hosts(tmp_path: Path, way: str) -> None:
    value = "file:///home/pi/cyclonedds.xml" if way == "file" else CYCLONE.replace("\n", "")
    files = {"cyclonedds.xml": CYCLONE} if way == "file" else {}
    script = f"export RMW_IMPLEMENTATION=rmw_cyclonedds_cpp\nexport CYCLONEDDS_URI='{value}'\n"
    made = draft(lab(tmp_path, {"setup.bash": script, **files}))
    found = data(made)
    assert found["ros"] == {"distro": "jazzy", "rmw": "cyclonedds", "domain": 7, "discovery": "peers"}
    assert [one["address"] for one in found["hosts"].values()] == ["192.168.77.11", "192.168.77.12"]
    for setting in ("Interfaces.NetworkInterface.name = wlan0", "AllowMulticast = false"):
        place = "cyclonedds.xml:" if way == "file" else "setup.bash:2"
        assert any(one.startswith(f"#   {place}") and setting in one for one in made.text.split("\n"))
    assert ("CYCLONEDDS_URI is file:///home/pi/cyclonedds.xml, of which" in made.text) is (way == "file")


def test_the_server_of_fast_dds_is_a_host(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"fastdds.xml": FAST}))
    found = data(made)
    assert found["ros"]["servers"] == ["server-1"]
    assert found["hosts"]["server-1"] == {"address": "192.168.77.11"}
    assert "discovery_config.discoveryProtocol = CLIENT has no key in a spec" in made.text


def test_static_peers_are_hosts(tmp_path: Path) -> None:
    text = "export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET\nexport ROS_STATIC_PEERS='192.168.77.11;pc.local'\n"
    made = draft(lab(tmp_path, {"setup.bash": text}))
    found = data(made)
    assert [one["address"] for one in found["hosts"].values()] == ["192.168.77.11", "pc.local"]
    assert found["ros"] == {"distro": "jazzy", "discovery": "peers"}
    assert "#   discovery: the peers are kept, and not the range of discovery" in made.text
