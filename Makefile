# make run and make test do all set-up themselves; nothing else is needed on a fresh machine but Python 3.11 and make.
PYTHON ?= $(shell command -v python3.11 || command -v python3.12 || command -v python3.13 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
CONSTRAINTS := .ci/constraints.txt
INSTALLED := $(VENV)/.installed
INSTALLED_VALIDATION := $(VENV)/.installed-validation
WORKERS ?= 2

.PHONY: run test kernels lint validate benchmark peers format clean system system-tests system-validation

run: $(INSTALLED)
	$(BIN)/python main.py

# The types are checked by one processor while the others compile.
test: system-tests $(INSTALLED)
	@$(MAKE) --no-print-directory --jobs=2 --output-sync=target lint kernels
	$(BIN)/pytest -n $(WORKERS) --dist worksteal

# Compiled once by all processors: each of the test's processes would compile them again for itself.
kernels: $(INSTALLED)
	@$(BIN)/python -m studio.scan.kernel_warm_up all

lint: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

validate: $(INSTALLED_VALIDATION)
	$(BIN)/pytest -m validation tests

benchmark: system-tests $(INSTALLED)
	@for script in $(filter-out %/bench_peers.py %/bench_bars.py,$(wildcard tests/benchmarks/bench_*.py)); do echo "== $$script"; $(BIN)/python $$script || exit 1; done

peers: $(INSTALLED_VALIDATION)
	$(BIN)/python tests/benchmarks/bench_peers.py

format: $(INSTALLED)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) .cache build *.egg-info .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Names what the machine lacks, or installs it where the user is root on Debian or Ubuntu.
system:
	@$(if $(PYTHON),,$(error no Python found; install it with: apt-get update && apt-get install -y python3.11 python3.11-venv))$(PYTHON) studio/runtime/system.py

system-tests: system
	@$(PYTHON) studio/runtime/system.py --tests

system-validation: system
	@$(PYTHON) studio/runtime/system.py --validation

$(INSTALLED): pyproject.toml $(CONSTRAINTS) | system
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c $(CONSTRAINTS) -e .[test]
	@touch $@

$(INSTALLED_VALIDATION): $(INSTALLED) | system-validation
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c $(CONSTRAINTS) -e .[validation]
	@touch $@
