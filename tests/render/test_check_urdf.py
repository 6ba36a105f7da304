"""The URDF of every shipped type, as `check_urdf` of ROS's own parser reads it."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from swarmctl.render.driver_config import model_of, urdf
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import params_of
from swarmctl.spec.catalog import load_catalog

pytestmark = pytest.mark.skipif(
    shutil.which("check_urdf") is None, reason="check_urdf is missing: apt install liburdfdom-tools"
)


def test_check_urdf_takes_the_model_of_every_shipped_type(tmp_path: Path) -> None:
    types = with_protocol(load_catalog().types)
    assert types
    for name, one in types.items():
        file = tmp_path / f"{name}.urdf"
        params = params_of(one, robot="r1", namespace="/r1", port="/dev/robot")
        file.write_bytes(urdf("r1", model_of(params)))
        done = subprocess.run(["check_urdf", str(file)], capture_output=True, text=True, check=False)
        printed = done.stdout + done.stderr
        assert done.returncode == 0, printed
        assert not re.search("error|warn", printed, re.IGNORECASE), printed
        assert "root Link: base_link" in printed, printed
