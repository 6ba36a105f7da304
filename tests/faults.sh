#!/usr/bin/env bash
# `make faults`: a lab of the example swarm, and what status says of each fault of tests/faults.yaml.
set -euo pipefail
cd "$(dirname "$0")/.."
spec=examples/paper-leader/swarm.yaml
name=${1:-faults-$$}
trap 'swarmctl lab down --name "$name"' EXIT
swarmctl lab up "$spec" --name "$name" >&2
swarmctl deploy "$spec" --lab-name "$name" --yes >&2
swarmctl lab scenario "$spec" tests/faults.yaml --name "$name"
