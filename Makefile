PYTHON ?= python3
BIN := .venv/bin
# pyNastran's metadata asks for numpy < 2; the tests use its bulk-data reader, which runs with numpy 2.
NASTRAN := pyNastran==1.4.1 cpylog docopt-ng
# Python keeps the bytecode of what it imports, also where it is told not to: the tests start a hundred processes. So pip need not
# compile everything first, which takes a minute.
unexport PYTHONDONTWRITEBYTECODE
PIP := $(BIN)/python -m pip install --quiet --no-compile

.PHONY: demo test test-minimum lint types layers wheel results docs clean

demo: .venv/core
	$(BIN)/jointbench demo --out out/demo --force

test: .venv/full lint types layers
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder tests

# A sample, a file or two for each package that is bound from below.
MINIMUM := signals recording documents files figures reading record_formats laws rig polynomial settings campaign_plan report native

test-minimum: .venv-minimum/ready
	.venv-minimum/bin/python -m pytest $(MINIMUM:%=tests/test_%.py)

lint: .venv/full
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: .venv/full
	$(BIN)/pyrefly check

layers: .venv/full
	$(BIN)/lint-imports

docs: .venv/full
	$(BIN)/python scripts/docs.py --check
	NO_MKDOCS_2_WARNING=1 DISABLE_MKDOCS_2_WARNING=true $(BIN)/python -m mkdocs build --strict -f scripts/site/mkdocs.yml
	$(BIN)/python scripts/snippets.py
	$(BIN)/python scripts/notebooks.py --check

results: .venv/full
	$(BIN)/python scripts/results.py

.venv/bin/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "jointbench needs Python 3.11 or newer; set PYTHON=… to one")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip

.venv/core: pyproject.toml constraints.txt | .venv/bin/python
	$(PIP) -c constraints.txt -e .
	touch $@

.venv/full: pyproject.toml constraints.txt | .venv/bin/python
	$(PIP) -c constraints.txt -e '.[rl,scale,io,onnx,peers,docs,test]'
	$(PIP) --no-deps $(NASTRAN)
	touch $@ .venv/core

# the oldest versions that pyproject.toml states, resolved into a file of constraints
.venv-minimum/ready: pyproject.toml
	$(PYTHON) -m venv .venv-minimum
	.venv-minimum/bin/python -m pip install --quiet --upgrade pip uv
	.venv-minimum/bin/uv pip compile --quiet --resolution lowest-direct --python .venv-minimum/bin/python \
		--extra test --extra io --extra scale -o .venv-minimum/constraints.txt pyproject.toml
	.venv-minimum/bin/python -m pip install --quiet -c .venv-minimum/constraints.txt -e '.[test,io,scale]'
	touch $@

clean:
	rm -rf .venv .venv-minimum out build dist
