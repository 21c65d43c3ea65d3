# Targets of one line; the work is in tools/. PYTHON=... chooses the interpreter for .venv.

.DEFAULT_GOAL := help
.PHONY: help setup setup-test test lint fly bench bench-flights bench-steps fuzz clean

# A sourced ROS installation must not mix with the ROS in .venv, and a Python started by the ROS
# wheels hands down a guard that would keep those of .venv from starting.
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

setup: ## make .venv with the package and ROS 2 Jazzy (PYTHON=python3.12 chooses the Python)
	@tools/setup-venv run

setup-test:
	@tools/setup-venv test

test: setup-test ## setup, then every test, ruff, mypy and the import rules
	@tools/check tests ruff format mypy imports

lint: setup-test ## the same without the tests
	@tools/check ruff format mypy imports

fly: setup ## throw a disc in real time, record and plot it (DISC=wraith THROW='--speed 25 --spin 120')
	@if $(BIN)/python -c 'import rclpy' 2>/dev/null; then \
		$(BIN)/demo $(if $(DISC),--disc '$(DISC)') $(THROW); \
	else \
		echo 'fly: no ROS 2 in .venv: the throw is computed, without simulator, recorder and bag'; \
		mkdir -p flights && \
		$(BIN)/fly --plot flights/fig5.png $(if $(DISC),--disc '$(DISC)') $(THROW); \
	fi

bench-flights: setup-test ## measure flights per second
	@$(BIN)/python benchmarks/flights.py

bench-steps: setup-test ## draw the error over the step, in despun axes and in spinning ones
	@$(BIN)/python benchmarks/steps.py --write

bench: setup-test ## measure everything beside its peers, 6 minutes; writes the tables of docs/ and README
	@$(BIN)/python benchmarks/run.py --write $(if $(PEERS),--peers '$(PEERS)')

fuzz: setup-test ## fuzz every input, 10 minutes each (after .venv/bin/pip install -e .[fuzz])
	@nice -n 19 $(BIN)/python benchmarks/fuzz/run.py all --seconds 600

clean: ## remove .venv, builds and caches; keep flights/ and bags/
	rm -rf .venv build dist install log *.egg-info .coverage .hypothesis \
		.import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
