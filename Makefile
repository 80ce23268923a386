# The newcomer's two commands are `make demo` and `make test`; CONTRIBUTING.md tells the rest.

PYTHONS := python3 python3.14 python3.13 python3.12 python3.11
PYTHON ?= $(shell for python in $(PYTHONS); do \
	$$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$python && break; done)
VENV := .venv
BIN := $(VENV)/bin
WORKERS ?= auto # pytest processes, one for each core; 0: none beside the main one
SPREAD := --dist loadfile --no-loadscope-reorder # whole files, in the order of tests/conftest.py
IN_REAL_TIME := tests/calib/capture/test_command.py tests/calib/capture/test_environment.py
LOCK_ARGS ?= # e.g. --upgrade, or --upgrade-package numpy

# Whoever asks Python to write no bytecode would have every process of the tests compile all that it imports anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo docs policies test test-all check check-beside-compiling format lock

help:
	@echo "make demo      install everything into $(VENV), calibrate and diagnose datasets/sample, print the path of its report"
	@echo "make docs      the documentation as a site in build/site; warnings are errors"
	@echo "make policies  install torch and stable-baselines3 too, train a small policy on datasets/sample and score it"
	@echo "make test      linter, type check, import contract and tests"
	@echo "make test-all  the same with the long tests; interrupted, it goes on where it was"
	@echo "make check     linter, type check and import contract alone"
	@echo "make format    let the formatter and the linter's fixes loose on the code"
	@echo "make lock      renew requirements.lock after a change in pyproject.toml (LOCK_ARGS=--upgrade for all)"

demo: $(VENV)/.installed
	@$(BIN)/calib run --effort quick datasets/sample
	@echo "What was put in, which the program never read (datasets/sample/CARD.md):"
	@sed -n 's/^- Withheld effect: /  /p' datasets/sample/CARD.md

# Offline, from the pages of docs/ and the notebooks as committed; `demo` and `test` need none of what it installs.
docs: $(VENV)/.docs-installed
	@rm -rf build/site # generated pages and the menu are not seen to have changed
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --builder html --conf-dir docs . build/site
	@echo build/site/index.html

# TORCH names another build of it, such as a wheel for the CPU alone.
TORCH ?= torch
policies: $(VENV)/.installed
	$(BIN)/python -m pip install --no-compile $(TORCH) --editable '.[policies]'
	$(BIN)/calib fit --effort quick datasets/sample
	$(BIN)/calib policy train --method sac --effort quick datasets/sample
	$(BIN)/calib policy evaluate --episodes 200 datasets/sample

# A thread for each process: threads of one test would wait for those of another.
test test-all: export SWIMCAL_WORKERS = 1
test test-all: export OMP_NUM_THREADS = 1
test test-all: export OPENBLAS_NUM_THREADS = 1

# Types are checked on one core. Meanwhile another compiles what the tests import, which in a clean clone each of their
# processes would else do by itself, for half a minute.
test test-all: check-beside-compiling

# A motor on a pseudo-terminal answers within milliseconds or not at all: its tests get the machine for themselves.
test:
	$(BIN)/python -m pytest -n $(WORKERS) $(SPREAD) -m "not long" $(IN_REAL_TIME:%=--ignore=%)
	$(BIN)/python -m pytest -n 0 -m "not long" $(IN_REAL_TIME)

test-all: export HYPOTHESIS_PROFILE ?= many
test-all: $(VENV)/.warp-installed
	$(BIN)/python -m pytest -n $(WORKERS) $(SPREAD) -p tests.resume $(IN_REAL_TIME:%=--ignore=%)
	$(BIN)/python -m pytest -n 0 $(IN_REAL_TIME)

check: $(VENV)/.installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

check-beside-compiling: $(VENV)/.installed
	@$(BIN)/python -m pytest --collect-only -qq >/dev/null 2>&1 & \
	$(MAKE) --no-print-directory check; checked=$$?; wait; exit $$checked

format: $(VENV)/.installed
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The lock is complete, so nothing is resolved; bytecode is compiled when first imported, which halves the time. uv takes
# an eighth of pip's time; where it cannot be had, or not reach the packages, pip does the same.
LOCKED := --require-hashes --no-deps --only-binary :all:
$(VENV)/.installed: requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { \
		echo "swimcal needs Python 3.11 or newer; looked for: $(PYTHONS). Name yours: make PYTHON=/path/to/python" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@{ $(BIN)/python -m pip install --quiet --no-compile uv && \
		$(BIN)/uv pip install --quiet --system-certs --python $(BIN)/python $(LOCKED) -r requirements.lock; } || \
		$(BIN)/python -m pip install $(LOCKED) --no-compile -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.docs-installed: $(VENV)/.installed docs/requirements.lock
	@$(BIN)/uv pip install --quiet --system-certs --python $(BIN)/python $(LOCKED) -r docs/requirements.lock || \
		$(BIN)/python -m pip install $(LOCKED) --no-compile -r docs/requirements.lock
	@touch $@

# Only a long test and users with a GPU need it; it is large.
$(VENV)/.warp-installed: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --no-compile --editable '.[warp]'
	@touch $@

# Of the extra `docs` its own lock has what is not in the main one.
lock:
	$(PYTHON) -m venv build/lock
	build/lock/bin/python -m pip install --quiet uv
	build/lock/bin/uv pip compile --quiet --no-config --universal --generate-hashes --only-binary :all: \
		--python-version 3.11 --group dev --custom-compile-command "make lock" $(LOCK_ARGS) \
		--output-file requirements.lock pyproject.toml
	build/lock/bin/python -c 'import tomllib; \
		print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["docs"], sep="\n")' \
		> build/lock/docs.txt
	build/lock/bin/uv pip compile --quiet --no-config --universal --generate-hashes --only-binary :all: \
		--python-version 3.11 --constraints requirements.lock --custom-compile-command "make lock" $(LOCK_ARGS) \
		--output-file docs/requirements.lock build/lock/docs.txt
