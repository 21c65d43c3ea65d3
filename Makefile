# Targets of one line; the work is in tools/. PYTHON=... chooses the interpreter for .venv.

.DEFAULT_GOAL := help
.PHONY: help setup setup-test lock test lint docs fly bench bench-flights bench-steps fuzz clean

# A sourced ROS installation must not mix with the ROS wheels in .venv. A Python started by the ROS
# wheels sets a guard variable that its child processes inherit; with it, the wheels of .venv do
# not start.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE AMENT_PREFIX_PATH PYTHONHOME PYTHONPATH

BIN := .venv/bin
DISC ?=
THROW ?=
PEERS ?=
export PYTHON

help: ## list the targets
	@echo 'make TARGET, where TARGET is one of'
	@sed -n 's/^\([a-z-]*\):.*## /\1	/p' Makefile | while IFS='	' read -r name text; do \
		printf '  %-14s %s\n' "$$name" "$$text"; done

setup: ## make .venv with the package and ROS 2 Jazzy (PYTHON=python3.12 selects the Python)
	@tools/setup-venv run

setup-test:
	@tools/setup-venv test

lock: ## install what setup.py needs in addition, then write requirements-dev.lock
	@tools/setup-venv lock

test: setup-test ## setup, then every test, ruff, mypy and the import rules
	@tools/check tests ruff format mypy imports

lint: setup-test ## the same without the tests
	@tools/check ruff format mypy imports

docs: setup-test ## build the documentation site in build/docs
	@$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet docs build/docs
	@echo 'open build/docs/index.html'

fly: setup ## throw a disc in real time, record and plot it (DISC=wraith THROW='--speed 25 --spin 120')
	@if $(BIN)/python -c 'import rclpy' 2>/dev/null; then \
		$(BIN)/demo $(if $(DISC),--disc '$(DISC)') $(THROW); \
	else \
		echo 'fly: .venv has no ROS 2: computing the throw without simulator, recorder and bag'; \
		mkdir -p flights && \
		$(BIN)/fly --plot flights/fig5.png --html flights/fig5.html $(if $(DISC),--disc '$(DISC)') $(THROW); \
	fi

bench-flights: setup-test ## measure flights per second
	@$(BIN)/python benchmarks/flights.py

bench-steps: setup-test ## draw the error over the step, in despun axes and in spinning ones
	@$(BIN)/python benchmarks/steps.py --write

bench: setup-test ## measure everything beside its peers, 7 minutes; writes docs/benchmarks.md and README
	@$(BIN)/python benchmarks/run.py --write $(if $(PEERS),--peers '$(PEERS)')

fuzz: setup-test ## fuzz every input, 10 minutes each (after .venv/bin/pip install -e .[fuzz])
	@nice -n 19 $(BIN)/python benchmarks/fuzz/run.py all --seconds 600

clean: ## remove .venv, builds and caches; keep flights/ and bags/
	rm -rf .venv build dist install log docs/api *.egg-info .coverage .hypothesis \
		.import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
