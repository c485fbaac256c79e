# make setup | demo | quick | test | qgis340 | qgis344 | lint | docs | qgis | parameters | figures | styles | models | translations | sample | package | lock | screenshot | clean
.PHONY: setup demo quick test qgis340 qgis344 lint docs qgis parameters figures styles models translations sample package lock screenshot clean
PYTHON = .venv/bin/python
SHELL = /bin/sh

setup:  ## system packages, .venv with the engine, a private QGIS profile; at once when nothing changed
	@sh tools/setup.sh

demo: setup  ## the main job on a small simulated plot, through qgis_process
	@$(PYTHON) tools/demo.py

test: lint docs  ## lint and docs, then all tests; real QGIS is driven
	@$(PYTHON) -m pytest -q

quick: setup  ## the tests of the library that are not slow and need no QGIS; those that failed most often first
	@$(PYTHON) -m pytest -q -m "not slow and not qgis"

lint: setup  ## format, style, the order of imports, types (Windows too)
	@$(PYTHON) -m ruff format --quiet --check .
	@$(PYTHON) -m ruff check --quiet .
	@.venv/bin/lint-imports --no-logo
	@$(PYTHON) -m mypy
	@$(PYTHON) -m mypy --platform win32

docs: setup  ## the site, build/docs/index.html, its notebooks run; a warning is an error
	@$(PYTHON) -m sphinx -q -b html -E -n -W --keep-going docs build/docs

qgis: setup  ## QGIS with the plugin, in the private profile
	@$(PYTHON) tools/open_qgis.py

parameters: setup  ## after a verb's settings, a pinned range, a quality limit or reason changed
	@$(PYTHON) tools/write_parameters.py
	@$(PYTHON) tools/write_limits.py
	@/usr/bin/python3 tools/write_models.py

figures: setup  ## the figures of README and docs, from docs/results
	@$(PYTHON) -m treedgs_lab.benchmarks.figures

styles: setup  ## the layers' styles, with PyQGIS
	@/usr/bin/python3 tools/write_styles.py

models: setup  ## the ready-made models, with PyQGIS
	@/usr/bin/python3 tools/write_models.py

qgis340:  ## the plugin's tests with QGIS 3.40 (Debian trixie in a folder; root, and network the first time)
	@sh tools/qgis.sh 3.40

qgis344:  ## the same with QGIS 3.44 (Debian sid)
	@sh tools/qgis.sh 3.44

translations: setup  ## collect and compile the texts (PyQGIS, lrelease)
	@/usr/bin/python3 tools/write_translations.py

sample: setup  ## sample/, the flight that the plugin's menu opens, from the demo's plot
	@$(PYTHON) tools/make_sample.py

package: sample  ## dist/: the plugin's zip, checked and scanned as the plugin repository does, and the wheel; release=1 for upload
	@$(PYTHON) tools/package.py $(if $(release),--release)

lock: setup  ## after the pinned ranges changed: every library of the engine with its hashes (uv, network)
	@$(PYTHON) tools/write_lock.py

screenshot: setup  ## docs/images/toolbox.png, under Xvfb
	@$(PYTHON) tools/screenshot.py

clean:  ## remove caches and the demo; 'make clean all=1' also .venv and .setup
	@rm -rf .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis build dist demo sample
	@find . -name __pycache__ -type d -not -path './.venv/*' -prune -exec rm -rf {} +
	@if [ -n "$(all)" ]; then rm -rf .venv .setup; fi
