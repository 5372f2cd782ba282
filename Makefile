# make serve [PORT=8080] | check | test | lint | kernel | benchmark | wasm | site | audit | release-check | constraints |
#      requirements | clean
#
# Needs Python >= 3.11 and make. The environment lives in .venv; uv builds it where it is
# installed, venv and pip otherwise. A stamp file per set of extras makes a second call instant.

VENV := .venv
BIN := $(VENV)/bin
PYTHON ?=
PORT ?=
# uv trusts the certificates that the system trusts, as pip and git do.
export UV_SYSTEM_CERTS ?= 1

# What is imported is compiled then and kept; most of what pip brings never is.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: serve check quick test test-browser test-others programs kernel kernels lint benchmark wasm site audit release-check constraints requirements clean
.DELETE_ON_ERROR:

serve: $(VENV)/.serve
	@$(BIN)/slipgrasp serve $(if $(PORT),--port $(PORT))

# What to run after every change: about as long as the type checker alone, which has one of two
# processors. Tests marked `slow`, and those in a browser, are left to `make test`.
check: $(VENV)/.develop
	@$(MAKE) --no-print-directory --jobs 2 lint quick

quick: $(VENV)/.develop
	$(BIN)/python -m pytest -q -n logical --dist worksteal -m "not slow and not browser"

# All tests; needs Chromium and curl, which it finds or installs.
test: programs
	@$(MAKE) --no-print-directory test-others
	@$(MAKE) --no-print-directory test-browser

test-browser: $(VENV)/.develop
	@# By file: collecting all tests once more takes longer than most of these.
	$(BIN)/python -m pytest -n logical --dist loadfile -m browser $$(grep -rl "mark.browser" tests --include=*.py)

test-others: $(VENV)/.develop
	$(BIN)/python -m pytest -n logical --dist worksteal -m "not browser"

programs: $(VENV)/.develop
	@$(BIN)/python tests/ensure_programs.py

# Compiles the simulation of all hands, which otherwise the first run does.
PREPARE := from slipgrasp.core.run.simulator import prepare_kernel; \
  from slipgrasp.core.scenario.space import SPACES; \
  [prepare_kernel(space=space) for space in SPACES]
kernel: $(VENV)/.develop
	$(BIN)/python -c "$(PREPARE)"

# The same, on two processors, and for WebAssembly too: a page that a test makes links all units that
# its process has declared, also those of rails and supports.
DECLARE := import runpy; from slipgrasp.core.kernel.rail import advance; \
  from slipgrasp.core.kernel.support import advance; \
  runpy.run_module('slipgrasp.core.kernel.webassembly.build', run_name='__main__')
kernels: $(VENV)/.develop
	@for end in first last; do \
	  $(BIN)/python -c "$(DECLARE)" $$end & \
	done; wait
	@$(BIN)/python -c "$(PREPARE)"

lint: $(VENV)/.develop
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/python .ci/link_packages.py
	$(BIN)/pyright --pythonpath $(BIN)/python
	cd build/links && $(abspath $(BIN))/lint-imports --config ../../pyproject.toml

benchmark: $(VENV)/.benchmark
	$(BIN)/python -m benchmarks

# The kernel as one file that runs in a browser: docs/webassembly.md.
wasm: $(VENV)/.wasm
	$(BIN)/python -m slipgrasp.core.kernel.webassembly.build build/slipgrasp.wasm

# The documentation as pages with a search and with live pages, to be read without a network:
# build/site/index.html.
site: $(VENV)/.site
	$(BIN)/python -m sphinx --quiet --fail-on-warning -c docs/site . build/site

# Looks for known vulnerabilities in what an installation takes: in the versions that are pinned, and
# in the least that pyproject.toml allows. Needs a network that reaches pypi.org, or, with
# AUDIT=--vulnerability-service=osv, api.osv.dev; fails where a package could not be looked up.
AUDIT ?=
audit: $(VENV)/.audit
	$(BIN)/pip-audit --strict $(AUDIT) --require-hashes --disable-pip --requirement requirements.txt
	@mkdir -p build
	uv pip compile pyproject.toml --extra dask --extra metrics --resolution lowest-direct \
	  --python-version 3.11 --no-emit-index-url --no-emit-find-links --no-annotate --quiet \
	  --output-file build/lowest.txt
	$(BIN)/pip-audit --strict $(AUDIT) --no-deps --disable-pip --requirement build/lowest.txt

# Builds a release twice, checks it, and installs it into an empty environment of each Python that
# is named (PYTHONS) or installed. It publishes nothing.
PYTHONS ?=
release-check: $(VENV)/.release
	$(BIN)/python .ci/release_check.py $(PYTHONS)

# Writes constraints.txt again, with the newest versions that pyproject.toml allows.
constraints:
	uv pip compile pyproject.toml --all-extras --universal --python-version 3.11 --upgrade \
	  --no-emit-index-url --no-emit-find-links --no-annotate --quiet \
	  --custom-compile-command "make constraints" --output-file constraints.txt

# Writes requirements.txt again: what an installation needs in the versions of constraints.txt, with
# the hashes of all files of each release, for every platform. setuptools builds slipgrasp itself.
requirements:
	echo 'setuptools>=77' | uv pip compile pyproject.toml - --extra dask --extra metrics \
	  -c constraints.txt --universal --python-version 3.11 --generate-hashes \
	  --no-emit-index-url --no-emit-find-links --no-annotate --quiet \
	  --custom-compile-command "make requirements" --output-file requirements.txt

clean:
	rm -rf $(VENV) build dist *.egg-info .hypothesis .import_linter_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.serve: REQUIREMENT := .
$(VENV)/.develop: REQUIREMENT := .[test,lint]
$(VENV)/.benchmark: REQUIREMENT := .[test,bench]
$(VENV)/.wasm: REQUIREMENT := .[wasm]
$(VENV)/.site: REQUIREMENT := .[site,wasm]
$(VENV)/.audit: REQUIREMENT := .[audit]
$(VENV)/.release: REQUIREMENT := .[release]

# Everything goes to standard error, so that the first line of `make serve` is the URL.
$(VENV)/.serve $(VENV)/.develop $(VENV)/.benchmark $(VENV)/.wasm $(VENV)/.site $(VENV)/.audit $(VENV)/.release: pyproject.toml setup.py constraints.txt $(BIN)/python
	@echo "slipgrasp: installing $(REQUIREMENT) into $(VENV), a minute or two the first time" >&2
	@if command -v uv >/dev/null 2>&1; then \
	  uv pip install --python $(BIN)/python -c constraints.txt -e '$(REQUIREMENT)' >&2; \
	else \
	  $(BIN)/python -m pip --version >/dev/null 2>&1 || $(BIN)/python -m ensurepip >&2; \
	  $(BIN)/python -m pip install --disable-pip-version-check --no-compile \
	    -c constraints.txt -e '$(REQUIREMENT)' >&2; \
	fi
	@touch $@

# The first interpreter that runs and is new enough; a shim that only exists is skipped.
$(BIN)/python:
	@fail() { echo "slipgrasp: $$1" >&2; exit 1; }; \
	for python in $(or $(PYTHON),python3.11 python3.12 python3.13 python3.14 python3 python); do \
	  "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && break; \
	  python=; \
	done; \
	test -n "$$python" || fail "no Python >= 3.11 found: install one, or name it with PYTHON=/path/to/python"; \
	if command -v uv >/dev/null 2>&1; then \
	  uv venv --quiet --clear --python "$$(command -v "$$python")" $(VENV) >&2; \
	else \
	  "$$python" -c 'import ensurepip, venv' 2>/dev/null || \
	    fail "$$python cannot make environments: install its venv package (Debian: apt-get install python3-venv) or uv"; \
	  "$$python" -m venv --clear $(VENV) >&2; \
	fi
