"""The type of each verb's answer."""

from __future__ import annotations

from typing import Mapping

from .cost_messages import CostsAnswer
from .history_messages import CommandRecordAnswer, HistoryAnswer
from .host_list_messages import HostListAnswer
from .log_messages import LogsAnswer
from .messages import (
    ApplyAnswer,
    ConfirmAnswer,
    FlashAnswer,
    HoldAnswer,
    LeaseAnswer,
    ObserveAnswer,
    RemoveAnswer,
    WireguardKeyAnswer,
)
from .motion_messages import MotionAnswer, RestartAnswer, StartAnswer, StopAnswer, TelemetryAnswer
from .preparation_messages import BuildAnswer, FetchBuildAnswer, InventoryAnswer, PrepareAnswer
from .probe_messages import ProbeAnswer
from .recording_messages import RecordingAnswer

#: The type of the answer by verb.
ANSWERS: Mapping[str, type] = {
    "observe": ObserveAnswer,
    "lease": LeaseAnswer,
    "host_list": HostListAnswer,
    "wireguard_key": WireguardKeyAnswer,
    "apply": ApplyAnswer,
    "rollback": ApplyAnswer,
    "history": HistoryAnswer,
    "command_record": CommandRecordAnswer,
    "logs": LogsAnswer,
    "hold": HoldAnswer,
    "confirm": ConfirmAnswer,
    "undo": ConfirmAnswer,
    "remove": RemoveAnswer,
    "flash": FlashAnswer,
    "probe": ProbeAnswer,
    "inventory": InventoryAnswer,
    "prepare": PrepareAnswer,
    "build_packages": BuildAnswer,
    "fetch_build": FetchBuildAnswer,
    "stop": StopAnswer,
    "start": StartAnswer,
    "restart": RestartAnswer,
    "motion": MotionAnswer,
    "telemetry": TelemetryAnswer,
    "costs": CostsAnswer,
    "record": RecordingAnswer,
    "recording": RecordingAnswer,
}
