# make demo, make test: everything else is for people who develop KiKS (CONTRIBUTING.md).

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV   := .venv
BIN    := $(VENV)/bin
# Many tests wait for processes that they start. Two workers for each processor keep all processors busy.
WORKERS = $(shell $(BIN)/python -c 'import os; print(2 * os.cpu_count())')
PYTEST = $(BIN)/python -m pytest -n $(WORKERS) --dist worksteal

# The tests start hundreds of Python processes: Python keeps the bytecode of the modules, whatever the environment says.
export PYTHONDONTWRITEBYTECODE =

.PHONY: demo test quick nightly checked setup system lint types docs benchmarks wheel octave-package clean

demo: setup
	$(BIN)/kiks demo follow --arena examples/arenas/office.toml --seconds 300 --picture kiks-demo.png

# Each test has a time limit, which does not include compiling the engine.
test: setup system
	$(BIN)/kiks warmup
	$(PYTEST)

quick: setup system
	$(BIN)/kiks warmup
	$(PYTEST) -m "not slow"

# All tests with all their examples: `make test` runs a share of the longest (tests/at_length.py).
nightly: setup system
	$(BIN)/kiks warmup
	KIKS_AT_LENGTH=1 $(PYTEST)

# The tests of the kernels in code that checks every index. It takes some minutes, as it compiles everything again.
checked: setup
	NUMBA_BOUNDSCHECK=1 $(PYTEST) -m "not slow" tests/engine tests/batch

setup: $(VENV)/.ready

# The environment is made anew when the list of what it holds changes.
$(VENV)/.ready: pyproject.toml tools/system-packages.sh
	@PYTHON="$(PYTHON)" sh tools/system-packages.sh
	$(or $(PYTHON),python3) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

system:
	@PYTHON="$(PYTHON)" sh tools/system-packages.sh tests

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mh_lint --brief matlab
	$(BIN)/mh_style --brief matlab

types: setup
	$(BIN)/mypy

docs: setup
	$(BIN)/python docs/make_commands.py

benchmarks: setup
	for name in wire sensors crowd programs desk batch evolve environments octave start; do $(BIN)/python benchmarks/$$name.py; done

# A wheel in `dist` that brings compiled kernels, for this version of Python. Any other way to build a wheel gives a pure one.
wheel: setup
	$(BIN)/python tools/compile_kernels.py build/kernels
	KIKS_KERNELS=build/kernels $(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

# A package for Octave in `dist`: pkg install dist/kiks-*.tar.gz, then pkg load kiks.
octave-package: setup
	$(BIN)/python tools/octave_package.py dist

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
