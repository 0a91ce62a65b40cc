# make demo, make test: everything else is for people who develop KiKS (CONTRIBUTING.md).

PYTHON ?= $(or $(shell command -v python3.11 || command -v python3),python3)
VENV   := .venv
BIN    := $(VENV)/bin
UV     := $(or $(shell command -v uv),$(BIN)/uv)
# Tests start processes, such as a browser, that work beside them: one worker more than processors keeps all busy.
WORKERS = $(shell $(BIN)/python -c 'import os; print(1 + os.cpu_count())')
PYTEST = $(BIN)/python -m pytest -n $(WORKERS) --dist worksteal

# The tests start hundreds of Python processes: Python keeps the bytecode of the modules, whatever the environment says.
export PYTHONDONTWRITEBYTECODE =

.PHONY: demo test test-all quick checked interpreters libraries user setup system lint types docs engine benchmarks wheel octave-package clean

demo: user
	$(BIN)/kiks demo follow --arena examples/arenas/office.toml --seconds 300 --export kiks-demo.png

# The engine is compiled before the first test, whose time limit does not include that (tests/conftest.py).
test: setup system
	$(PYTEST)

# All tests with all their examples: `make test` tests each feature once (tests/at_length.py).
test-all: setup system
	KIKS_AT_LENGTH=1 $(PYTEST)

quick: setup system
	$(PYTEST) -m "not slow"

# The tests of the kernels in code that checks every index. It takes some minutes, as it compiles everything again.
checked: setup
	NUMBA_BOUNDSCHECK=1 $(PYTEST) -m "not slow" tests/engine tests/batch

# The tests of what depends on the interpreter, under the other versions of Python that are here (noxfile.py).
interpreters: setup system
	PATH="$(BIN):$$PATH" $(BIN)/nox

# Tests with the lowest and the newest versions of libraries that `pyproject.toml` allows.
libraries: setup
	PATH="$(BIN):$$PATH" $(BIN)/nox --session libraries

user: $(VENV)/.user
setup: $(VENV)/.developer

# Both environments are brought up to date when the list of what they hold changes.
$(VENV)/.user: pyproject.toml tools/system-packages.sh
	@PYTHON="$(PYTHON)" sh tools/system-packages.sh
	@echo 'Installing KiKS into $(VENV) ...'
	@$(PYTHON) -m venv $(VENV)
	@command -v $(UV) >/dev/null || $(BIN)/python -m pip install -qq --disable-pip-version-check uv || true
	@$(call install,.)
	@touch $@

$(VENV)/.developer: $(VENV)/.user
	@echo 'Installing what the tests need ...'
	@$(call install,.[dev])
	@touch $@

# uv takes a tenth of the time of pip. Where it cannot get the packages, for instance because only pip knows the mirror, pip installs them,
# and builds those that have no wheel for a new Python yet.
install = $(UV) pip install --quiet --python $(BIN)/python --only-binary :all: --no-binary kiks --editable '$(1)' || \
	{ echo 'uv cannot install these. pip tries next, and builds what has no wheel.'; \
	$(BIN)/python -m pip install -qq --disable-pip-version-check --prefer-binary --editable '$(1)'; }

system:
	@PYTHON="$(PYTHON)" sh tools/system-packages.sh tests

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell .ci benchmarks docs examples matlab src tests tools *.md Makefile noxfile.py pyproject.toml
	$(BIN)/mh_lint --brief matlab
	$(BIN)/mh_style --brief matlab

types: setup
	$(BIN)/mypy

# The site, in build/docs. Needs no network; a warning, such as of a link that leads nowhere, is an error.
docs: setup
	$(BIN)/python docs/pages/protocol.py
	$(BIN)/sphinx-build -q -W --keep-going docs build/docs

# The engine for browsers, which the package carries: again after a kernel has changed (a test says so).
engine: setup
	$(BIN)/python tools/build_engine.py

benchmarks: setup
	for name in wire sensors crowd programs desk batch evolve environments octave start; do $(BIN)/python benchmarks/$$name.py; done

# A wheel in `dist` that brings compiled kernels, for this version of Python. Any other way to build a wheel gives a pure one.
wheel: setup
	$(BIN)/python tools/compile_kernels.py build/kernels
	KIKS_KERNELS=build/kernels $(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

# A package for Octave in `dist`: pkg install dist/kiks-octave-*.tar.gz, then pkg load kiks.
octave-package: setup
	$(BIN)/python tools/octave_package.py dist

clean:
	rm -rf $(VENV) .nox build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
