#!/usr/bin/env bash
# `make faults`: a lab of each swarm, and what status says of each fault of its scenario file.
set -euo pipefail
cd "$(dirname "$0")/.."
name=${1:-faults-$$}
trap 'swarmctl lab down --name "$name"' EXIT

all_of() { # SCENARIO SPEC...
    swarmctl lab up "${@:2}" --name "$name" >&2
    swarmctl deploy "${@:2}" --lab-name "$name" --yes >&2
    swarmctl lab scenario "${@:2}" "$1" --name "$name" || status=$?
    swarmctl lab down --name "$name" >&2
}

status=0
all_of tests/faults.yaml examples/paper-leader/swarm.yaml
all_of tests/faults-of-islands.yaml examples/paper-4-standalone/swarm.yaml -f tests/faults-of-islands.overlay.yaml
all_of tests/faults-of-ros2.yaml tests/faults-of-ros2.swarm.yaml
exit $status
