# Everything a newcomer or a machine does with this repository.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DEMO := runs/demo
DEMO_PARTS := simulate modes loop map
# What is never imported need not be compiled: 15 instead of 44 s of processor time.
INSTALL := $(BIN)/python -m pip install --quiet --no-compile

.PHONY: demo test test-all test-lowest lint format docs bench reports clean

# The product alone; each kind of work adds its own tools, noted by a file of that name.
$(VENV)/product: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade "pip>=24"
	$(INSTALL) -e .
	@touch $@

$(VENV)/test $(VENV)/lint $(VENV)/docs $(VENV)/bench: $(VENV)/%: $(VENV)/product
	$(INSTALL) -e ".[$*]"
	@touch $@

# The source paper's case: modes, loop, one run, the J1 map; figures, data and summaries.
demo: $(VENV)/product
	@$(MAKE) --no-print-directory -j 2 $(DEMO_PARTS:%=demo-%)
	@echo "pictures, data and summaries: $(CURDIR)/$(DEMO)"

demo-%:
	$(BIN)/drillctl $* monteiro-trindade-140kn --out $(DEMO)/$*

demo-map: demo-simulate  # which compiles the solver that both need

test: $(VENV)/test
	$(BIN)/python -m pytest -q -n 2 --dist loadfile -m "not slow"

test-all: $(VENV)/test
	$(BIN)/python -m pytest -q -n 2 --dist loadfile

# The lower bounds of pyproject.toml, in an environment of their own.
test-lowest:
	$(PYTHON) -m venv $(VENV)-lowest
	$(VENV)-lowest/bin/python -m pip install --quiet -c lowest.txt -e ".[test]"
	$(VENV)-lowest/bin/python -m pytest -q -n 2 -m "not slow"

lint: $(VENV)/lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/lint
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The documentation site, in build/docs; warnings and broken links are errors.
docs: $(VENV)/docs
	$(BIN)/python -m sphinx -W --keep-going -q -b html -d build/doctrees docs build/docs
	$(BIN)/python docs/check_links.py build/docs
	@echo "site: $(CURDIR)/build/docs/index.html"

# The table, the JSON file and the picture of benchmarks/README.md. A peer that cannot be installed
# is told there as missing. `make bench BENCH=--quick` for a look.
bench: $(VENV)/product
	-$(MAKE) $(VENV)/bench
	$(BIN)/python -m benchmarks.run $(BENCH)

clean:
	rm -rf runs build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -not -path "./$(VENV)*" -prune -exec rm -rf {} +

# Everything under reports/, made again; the HTML of each report under runs/reports/.
reports: $(VENV)/product
	$(BIN)/python reports/make.py
	$(BIN)/python docs/make_weight_on_bit.py
