# Every target does its own set-up; nothing outside .venv is touched, except that missing
# system libraries are installed with apt where that is permitted.

.DEFAULT_GOAL := help
.PHONY: help setup demo test lock clean
SHELL := /bin/bash
BIN := .venv/bin
unexport PYTHONDONTWRITEBYTECODE # or each of many processes would compile all sources anew

# The rendering back end that the set-up found, unless the caller names one.
BACKEND = export MUJOCO_GL=$${MUJOCO_GL:-$$(cat .venv/.backend)}

help: ## say what there is
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /make \1\t/' | expand -t 14

setup: ## make .venv with the locked packages and see that pictures can be rendered
	@.ci/setup.sh

demo: setup ## run the two-test experiment and print its tables
	@$(BACKEND); $(BIN)/aoicell demo

# Types and architecture, which take one core, are checked beside the tests and shown below them.
test: setup ## style, types, architecture and tests
	@.ci/setup.sh --browser
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@$(BACKEND); mkdir -p .cache; \
	    { $(BIN)/mypy && $(BIN)/lint-imports --no-logo --cache-dir .cache/import-linter; } \
	        &>.cache/static.log & static=$$!; \
	    $(BIN)/pytest -n auto --dist loadfile; tests=$$?; \
	    wait $$static; static=$$?; \
	    cat .cache/static.log; exit $$((tests || static))

lock: ## resolve requirements.lock anew from pyproject.toml
	@python3 -m venv .cache/lock
	@.cache/lock/bin/pip --quiet --disable-pip-version-check install uv
	@.cache/lock/bin/uv --quiet pip compile pyproject.toml --all-extras --group dev --upgrade \
	    --universal --python-version 3.11 --generate-hashes \
	    --no-emit-index-url --no-emit-find-links \
	    --custom-compile-command "make lock" --output-file requirements.lock

clean: ## remove everything that was made, .venv included
	rm -rf .venv .cache .hypothesis dist build
	find src tests models -name __pycache__ -type d -prune -exec rm -rf {} +
