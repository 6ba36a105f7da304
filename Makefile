# Everything a fresh Debian 12 or Ubuntu 22.04+ machine needs is python3, make and git.
#   make demo    the example swarm: boot it, deploy it, drive it
#   make test    every test, the lab included (needs root for the lab)

SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
ROS ?= 1
BIN := $(VENV)/bin
INSTALL := $(BIN)/pip install --quiet --disable-pip-version-check
LOCK := $(BIN)/uv pip compile --quiet --universal --python-version 3.10 --no-emit-index-url --no-annotate --no-header --generate-hashes
# tool:package pairs; a tool that is there already is not installed again
LAB_TOOLS := mmdebstrap:mmdebstrap systemd-nspawn:systemd-container ip:iproute2 ssh:openssh-client
TEST_TOOLS := nft:nftables check_urdf:liburdfdom-tools sshd:openssh-server sudo:sudo gcc:gcc g++:g++ avr-gcc:gcc-avr avrdude:avrdude \
  rviz:rviz Xvfb:xvfb softhsm2-util:softhsm2 pkcs11-tool:opensc ansible-inventory:ansible-core \
  wg:wireguard-tools wireguard-go:wireguard-go udevadm:udev
# path:package pairs, for what is no program
TEST_FILES := /usr/lib/avr/include/avr/io.h:avr-libc /usr/share/arduino/hardware/arduino/avr:arduino-core-avr \
  /usr/include/simavr/sim_avr.h:libsimavr-dev /usr/include/math.h:libc6-dev
# Ubuntu and later Debians have other versions of them, or none.
DDS_FILES := /usr/include/fastdds/dds/domain/DomainParticipant.hpp:libfastrtps-dev /usr/include/dds/dds.h:cyclonedds-dev
POWER_TOOLS := mkfs.ext4:e2fsprogs mkfs.xfs:xfsprogs mkfs.btrfs:btrfs-progs
EDITOR_TOOLS := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/swarmctl/editor-tools
MONITORING_TOOLS := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/swarmctl/monitoring-tools
# Tests wait more than they compute.
WORKERS := $(shell expr $$(nproc) \* 3)
# For tests whose number of examples is chosen: without the limit of time that ends a test that hangs.
UNLIMITED := -o faulthandler_timeout=0
LABS := $(shell expr $$(nproc) \* 2)
# The tests start some thousand processes: each would compile the package anew.
unexport PYTHONDONTWRITEBYTECODE
SUDO := $(shell [ "$$(id -u)" = 0 ] || echo sudo)

.PHONY: demo test test-all check busy power-cuts unsynced races scorecard attacks experiments dead-man faults motion fuzz lint format generated man bench bench-tools lock audit clean distclean lab-tools test-tools power-tools editor-tools monitoring-tools page-tools
.DEFAULT_GOAL := help

help: ## show the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 15

demo: $(VENV)/.run lab-tools ## boot the example swarm, deploy it, drive it; ROS=2 for the one of ROS 2
	@$(SUDO) PATH="$(CURDIR)/$(BIN):$$PATH" ROS=$(ROS) examples/paper-leader/demo.sh

test: $(VENV)/.dev lab-tools test-tools editor-tools monitoring-tools page-tools lint ## lint, then every test; a file with failures is run once more, alone
	$(BIN)/python -m tests.run --workers $(WORKERS) --labs $(LABS) $(PYTEST_ARGS)

test-all: $(VENV)/.dev lab-tools test-tools editor-tools monitoring-tools page-tools lint power-cuts unsynced races ## test, and what takes long: mutations, fuzzing, power cuts, races, tables of the lab
	SWARMCTL_FUZZ=$${SWARMCTL_FUZZ:-5000} SWARMCTL_SPECS=$${SWARMCTL_SPECS:-20000} $(BIN)/python -m tests.run --all --workers $(WORKERS) --labs $(LABS) $(PYTEST_ARGS)

check: $(VENV)/.dev lint ## lint, then for 90 s the fast tests, those of what you changed first
	$(BIN)/pytest -n 2 -m "not lab and not slow" -p tests.changed_first --within 90 $(PYTEST_ARGS)

busy: $(VENV)/.dev ## the fast tests beside 8 busy processes: none may fail for want of CPU time
	@for busy in 1 2 3 4 5 6 7 8; do (while :; do :; done) & pids="$$pids $$!"; done; \
	  trap "kill $$pids" EXIT; $(BIN)/pytest -n $(WORKERS) --dist worksteal -m "not lab and not slow" $(PYTEST_ARGS)

power-cuts: $(VENV)/.dev power-tools ## cut the power of a host at every system call of its changes, and look after the next boot (needs root)
	$(SUDO) $(BIN)/python -m tests.power $(POWER_ARGS)

unsynced: $(VENV)/.dev power-tools ## take away each sync of a host's changes in turn: a power cut must show it (needs root)
	$(SUDO) $(BIN)/python -m tests.power.unsynced

experiments: $(VENV)/.dev lab-tools ## the paper's five experiments in the lab; SWARM_TRIALS=10 keeps ten trials of each in build/experiments, and draws docs/experiment-*.png; SWARM_SECURITY=sealed for sealed ones (needs root)
	$(BIN)/pytest $(UNLIMITED) -m lab tests/e2e/test_paper.py tests/e2e/test_ros2.py $(PYTEST_ARGS)
	@for one in $(if $(SWARM_TRIALS),build/experiments/*); do \
	  $(BIN)/swarmctl capsule compare $$one --plot docs/experiment-$${one##*/}.png || exit 1; done

motion: $(VENV)/.run ## motion commanded against motion driven, with the papers' formulas; writes docs/motion-quality.md
	$(BIN)/python benchmarks/motion.py --page docs/motion-quality.md

dead-man: $(VENV)/.dev lab-tools ## how soon robots stop for each fault; writes the table of docs/dead-man.md (needs root)
	$(BIN)/pytest -m lab tests/e2e/test_dead_man.py --regenerate $(PYTEST_ARGS)

faults: $(VENV)/.run lab-tools ## what status says of each fault of tests/faults*.yaml, how soon, and when it is gone (needs root)
	@$(SUDO) PATH="$(CURDIR)/$(BIN):$$PATH" tests/faults.sh

lint: $(VENV)/.dev ## style, types, Python 3.8 on robots, and who may import whom
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/vermin --quiet --no-tips --target=3.8- templates/onboard
	$(BIN)/lint-imports

fuzz: $(VENV)/.dev ## many more hostile specs than make test has
	SWARMCTL_FUZZ=$${SWARMCTL_FUZZ:-20000} $(BIN)/pytest $(UNLIMITED) -q tests/yamltext/test_fuzz.py

format: $(VENV)/.dev ## format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

generated: $(VENV)/.dev ## regenerate schemas and reference pages from the models
	$(BIN)/swarmctl schema swarm > schemas/swarm.schema.json
	$(BIN)/swarmctl schema robot-type > schemas/robot-type.schema.json
	$(BIN)/swarmctl schema swarm --markdown > docs/swarm-reference.md
	$(BIN)/swarmctl schema robot-type --markdown > docs/robot-type-reference.md
	$(BIN)/python tools/checks_page.py > docs/checks.md

man: $(VENV)/.run ## manual pages of all verbs in build/man; read one with man -M build/man swarmctl-plan
	$(BIN)/python tools/man_pages.py build/man/man1

bench-tools: ## install the tools that benchmarks/compare.py compares with, into build/tools
	$(PYTHON) -m venv build/tools
	build/tools/bin/pip install --quiet ansible-core asyncssh fabric mitogen pyinfra

bench: $(VENV)/.dev ## run every benchmark
	@for benchmark in benchmarks/*.py; do echo "== $$benchmark"; $(BIN)/python $$benchmark || exit 1; done

lock: $(VENV)/.dev ## update the locked versions and hashes
	$(BIN)/pip install --quiet uv
	$(LOCK) --upgrade -o requirements/run.txt pyproject.toml
	$(LOCK) -c requirements/run.txt -o requirements/dev.txt pyproject.toml requirements/dev.in
	$(LOCK) -c requirements/dev.txt -o requirements/build.txt requirements/build.in
	$(LOCK) -c requirements/dev.txt -o requirements/audit.txt requirements/audit.in

audit: build/audit/.made ## look the locked packages up among known vulnerabilities; fails if the service cannot be reached
	@build/audit/bin/python tools/audit.py requirements/run.txt

build/audit/.made: requirements/audit.txt
	@$(PYTHON) -m venv build/audit
	@build/audit/bin/pip install --quiet --disable-pip-version-check --require-hashes -r requirements/audit.txt
	@touch $@

# The environment: the locked versions, and this checkout in place.
$(VENV)/.made:
	@echo "-- making $(VENV)"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "swarmctl needs Python 3.10 or newer, and $(PYTHON) is older: make PYTHON=python3.11" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || { $(SUDO) apt-get update -qq; $(SUDO) apt-get install -y -qq python3-venv; }
	@$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.run: $(VENV)/.made requirements/run.txt requirements/build.txt pyproject.toml
	@echo "-- installing what swarmctl needs (about 20 s)"
	@$(INSTALL) --require-hashes -r requirements/run.txt -r requirements/build.txt
	@$(INSTALL) --no-build-isolation --no-deps -e .
	@touch $@

$(VENV)/.dev: $(VENV)/.run requirements/dev.txt
	@echo "-- installing what the tests need (about 20 s)"
	@$(INSTALL) --require-hashes -r requirements/dev.txt
	@touch $@

lab-tools:
	@$(call install,$(LAB_TOOLS))
	@[ -e /usr/share/keyrings/debian-archive-keyring.gpg ] || $(call fetch,debian-archive-keyring)

test-tools:
	@$(call install,$(TEST_TOOLS))
	@$(call install_files,$(TEST_FILES))
	@$(call install_files,$(DDS_FILES)) || echo "-- Fast DDS or Cyclone DDS cannot be installed: its tests are skipped"

races: $(VENV)/.dev ## 1 000 races of a confirmation against its deadline, 50 of two operators on the same hosts
	SWARM_RACES=$${SWARM_RACES:-1000} SWARM_DEPLOY_RACES=$${SWARM_DEPLOY_RACES:-50} \
	  $(BIN)/pytest $(UNLIMITED) -q tests/onboard/agent/test_confirm.py tests/deploy/test_two_operators.py -k "agree or at_once"

scorecard: $(VENV)/.dev lab-tools ## what a deploy promises under 61 faults: the table, with the tests that show it (needs root)
	@$(BIN)/python -m tests.scorecard

attacks: $(VENV)/.dev lab-tools ## 27 attacks on the example swarm from 6 positions, at each level of security: what succeeds (needs root)
	@$(SUDO) $(BIN)/python -m tests.attacks

power-tools:
	@$(call install,$(POWER_TOOLS))

editor-tools: ## the YAML language server for the tests of editors, if npm is installed; else they are skipped
	@[ -x $(EDITOR_TOOLS)/node_modules/.bin/yaml-language-server ] || \
	  timeout 90 npm install --silent --no-audit --no-fund --ignore-scripts --fetch-retries=0 \
	    --prefix $(EDITOR_TOOLS) yaml-language-server@1.25.0 >/dev/null 2>&1 || \
	  echo "-- npm is missing or failed: the tests of the YAML language server are skipped"

monitoring-tools: ## Prometheus and promtool of Debian for the tests, unpacked but not installed; else they are skipped
	@[ -x $(MONITORING_TOOLS)/usr/bin/promtool ] || \
	  { made=$$(mktemp -d) && trap 'rm -rf "$$made"' EXIT && cd "$$made" && \
	    timeout 90 apt-get download -qq prometheus >/dev/null 2>&1 && dpkg-deb -x prometheus_*.deb unpacked && \
	    mkdir -p $(MONITORING_TOOLS) && cp -r unpacked/usr $(MONITORING_TOOLS)/; } || \
	  echo "-- prometheus cannot be downloaded: the tests with a Prometheus are skipped"

page-tools: ## Chromium for the tests of the page of `swarmctl ui`; else they are skipped
	@command -v chromium >/dev/null || \
	  { $(SUDO) apt-get update -qq && timeout 180 $(SUDO) env DEBIAN_FRONTEND=noninteractive \
	    apt-get install -y -qq --no-install-recommends chromium; } >/dev/null 2>&1 || \
	  echo "-- Chromium cannot be installed: the tests of the page are skipped"

fetch = { echo "-- installing" $(1); $(SUDO) apt-get update -qq && $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(1) >/dev/null; }
install = missing=; for pair in $(1); do PATH="$$PATH:/usr/sbin:/sbin" command -v "$${pair%%:*}" >/dev/null || missing="$$missing $${pair\#\#*:}"; done; \
  [ -z "$$missing" ] || $(call fetch,$$missing)
install_files = missing=; for pair in $(1); do [ -e "$${pair%%:*}" ] || missing="$$missing $${pair\#\#*:}"; done; \
  [ -z "$$missing" ] || $(call fetch,$$missing)

clean: ## remove caches and build results
	rm -rf build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +

distclean: clean ## remove the environment as well
	rm -rf $(VENV)
