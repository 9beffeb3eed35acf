# Plain verbs; run them in the environment of `pip install -e '.[dev]'`.
.PHONY: fly test lint types contracts format check

fly:
	companion fly --traj 4

test:
	pytest

lint:
	ruff check .
	ruff format --check .

types:
	mypy

contracts:
	lint-imports

format:
	ruff format .
	ruff check --fix .

check: lint types contracts test
