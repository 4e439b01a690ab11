# make run [PORT=8000]   set everything up and serve the editor
# make warm              set everything up and compile the kernels of the built-in scenes and of the library: 2 min, once
# make test              set everything up and pass the tests
# make long-test         pass the tests that `make test` leaves out: those that take longest, and those of the benchmarks;
#                        and the tests of pictures once more, by each scene's own kernels
# make extremes          every row of the tables of numerical stability, with a million samples
# make hostile           10 000 broken documents, 1 000 broken files and more: the long form of tests/service/test_hostile.py
# make image-test        build the container's image and run it; needs root, buildah and debootstrap, and minutes
# make soak [MINUTES=]   mixed clients and a hand in a browser while renderers are killed, and a table of it;
#                        with RENDERERS="--devices llvmpipe:2" or RENDERERS="--ray 2" there are several
# make gallery           render the README's pictures
# make thumbnails        render the editor's pictures of those presets that have changed
# make tradeoff          measure the price list anew: docs/tradeoff.*, what /v1/info says of the presets, the README
# make bench-compare [REV=HEAD]  this checkout beside a revision, in turns: speed, error, same bits or not
# make bench | lint | setup [PYTHON=python3.12]

PORT ?= 8000
export PYTHON
# Where it is set, every server under test would compile all modules, and every run of pytest all tests.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run warm test long-test extremes hostile image-test soak bench bench-compare tradeoff gallery thumbnails lint setup

run: setup
	@exec .venv/bin/sunbox serve --port $(PORT)

warm: setup
	@.venv/bin/sunbox warm

test:
	@.ci/setup test
	.venv/bin/sunbox info
	@.ci/test

long-test:
	@.ci/setup long
	@.ci/test long

extremes: setup
	SUNBOX_EXTREMES=1 .venv/bin/pytest tests/extremes tests/gpu/test_flags.py tests/shaders/test_furnace.py tests/shaders/test_light.py tests/service/rendering/test_stored_rows.py

hostile:
	@.ci/setup test
	HOSTILE_DOCUMENTS=10000 HOSTILE_FILES=1000 HOSTILE_EXAMPLES=100 .venv/bin/pytest -s tests/service/test_hostile.py tests/service/test_one_client.py

image-test: setup
	SUNBOX_IMAGE=1 .venv/bin/pytest -s -rs tests/test_image.py

soak:
	@.ci/setup test
	.venv/bin/python -m tests.bench soak --minutes $(or $(MINUTES),60) $(RENDERERS)
	.venv/bin/python -m tests.bench restarts $(RENDERERS)

bench: setup
	.venv/bin/sunbox bench speed -o out/bench.json

bench-compare: setup
	.venv/bin/python -m tests.bench compare --revision $(or $(REV),HEAD) -o out/compare.json

tradeoff: setup
	.venv/bin/sunbox bench tradeoff --publish

gallery: setup
	.venv/bin/python -m tests.bench gallery

thumbnails: setup
	.venv/bin/python -m tests.bench thumbnails

# JavaScript's formatter has no package for pip: it is run where it is there (npm install --global @biomejs/biome@2).
lint: setup
	.venv/bin/ruff check .
	.venv/bin/mypy
	if command -v biome >/dev/null; then biome format --config-path=.ci web; fi

setup:
	@.ci/setup
