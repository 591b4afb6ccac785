# Everything happens in this checkout: `make help` lists the targets.

BOARD ?= rpi_pico
PORT ?=
MICROPYTHON ?=
JOBS ?= 2
PYTEST_ARGS ?=
# Where sigrok looks for a user's decoders.
DECODERS ?= $(or $(XDG_DATA_HOME),$(HOME)/.local/share)/libsigrokdecode/decoders

VENV := .venv/.complete
PYTHON_IN_VENV := .venv/bin/python
GHST := .venv/bin/ghst

.DEFAULT_GOAL := help
.PHONY: help demo bench campaign mutation test lint micropython image firmware flash selftest sigrok .venv clean

help: ## This list
	@sed -n 's/^\([a-z][a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20

demo: $(VENV) ## Watch an emulated board follow a simulated Ghost receiver
	@$(GHST) demo

bench: $(VENV) ## Measure the firmware on the emulated chip, write docs/figures.md
	@$(GHST) bench

campaign: $(VENV) ## Attack the firmware on purpose, for hours; write docs/reliability.md
	@$(GHST) campaign

mutation: $(VENV) ## Break the firmware in many ways; the tests have to notice each
	@$(GHST) campaign mutation

test: $(VENV) micropython image firmware ## Run every test: CPython, the unix port, the emulated board
	@tools/debian.sh sigrok-cli=sigrok-cli tmux=tmux
	$(PYTHON_IN_VENV) -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder \
		$(PYTEST_ARGS) host_tests

lint: $(VENV) ## Check style and types
	$(PYTHON_IN_VENV) -m ruff check .
	$(PYTHON_IN_VENV) -m ruff format --check .
	$(PYTHON_IN_VENV) -m mypy

micropython: $(VENV) ## Get a MicroPython image, if there is none yet
	@$(GHST) micropython

image: $(VENV) ## Write build/BOARD/filesystem.img [BOARD=rpi_pico]
	@$(GHST) image --board $(BOARD)

firmware: $(VENV) ## Build an image with the firmware in it [BOARD=rpi_pico] [MICROPYTHON=sources]
	@$(GHST) firmware --board $(BOARD) $(if $(MICROPYTHON),--micropython $(MICROPYTHON))

flash: $(VENV) ## Put the firmware on a board [BOARD=rpi_pico] [PORT=/dev/ttyACM0]
	@$(GHST) flash --board $(BOARD) $(if $(PORT),--port $(PORT))

selftest: $(VENV) ## Have a board test itself, with one jumper [BOARD=rpi_pico] [PORT=/dev/ttyACM0]
	@$(GHST) selftest --board $(BOARD) $(if $(PORT),--port $(PORT)) $(if $(YES),--yes)

sigrok: ## Install the GHST decoder for PulseView and sigrok-cli [DECODERS=...]
	@mkdir -p "$(DECODERS)/ghst"
	@cp tools/sigrok/ghst/*.py "$(DECODERS)/ghst/"
	@echo "$(DECODERS)/ghst"

.venv: $(VENV)

$(VENV): tools/venv.sh tools/constraints.txt pyproject.toml
	@tools/venv.sh

clean: ## Remove what was built here, but not the cache of MicroPython
	rm -rf build .venv .pytest_cache .mypy_cache .ruff_cache .hypothesis
