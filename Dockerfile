# syntax=docker/dockerfile:1
# Sunbox on an NVIDIA GPU where the container is given one, else on the processor through Mesa's llvmpipe.
#   docker build -t sunbox .
#   docker run --rm --init --read-only --cap-drop ALL --security-opt no-new-privileges \
#     -p 127.0.0.1:8000:8000 -v sunbox:/data sunbox
#   docker run --rm --init --read-only --cap-drop ALL --security-opt no-new-privileges \
#     -p 127.0.0.1:8000:8000 -v sunbox:/data --gpus all -e SUNBOX_REQUIRE_GPU=1 sunbox
# With any of these extras: usd (USD files), models (FBX, COLLADA, 3DS, X3D), cad (STEP), ray (the nodes of a cluster,
# docs/scaling.md), plot (figures of `sunbox bsdf`) and ffmpeg (animations as .mp4):
#   docker build --build-arg EXTRAS="usd ffmpeg" -t sunbox .
# With the kernels of the processor that builds it, which take 2 min: docker build --build-arg WARM=1 -t sunbox .
# Debian 13 and not 12: on a processor its Mesa 25 traces 1.4 times as fast as Mesa 22. By digest,
# as a tag may become another image; Dependabot proposes the next one.

FROM python:3.13-slim-trixie@sha256:ffb752e139c0a19692a43af8d8523b274222dd68eebad5d583b45c2201c6e30a AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
RUN python -m venv /opt/sunbox
WORKDIR /source
COPY requirements.*.lock ./
ARG EXTRAS=
# All locks have the same version of what several of them need (a test).
RUN set -- -r requirements.serve.lock; \
    for extra in $EXTRAS; do \
        case "$extra" in \
            usd|models|cad|ray|plot) set -- "$@" -r "requirements.$extra.lock" ;; \
            ffmpeg|materialx) ;; \
            *) echo "EXTRAS: there is no extra '$extra'; there are usd, models, cad, ray, plot and ffmpeg" >&2; exit 1 ;; \
        esac; \
    done; \
    /opt/sunbox/bin/pip install --require-hashes --only-binary :all: "$@"
COPY pyproject.toml README.md ./
COPY client client
COPY gpu gpu
COPY service service
COPY shaders shaders
COPY web web
RUN python -m venv /opt/build \
    && /opt/build/bin/pip install --require-hashes --only-binary :all: -r requirements.build.lock \
    && /opt/build/bin/python -m hatchling build -t wheel -d /tmp/wheel \
    && (cd client && /opt/build/bin/python -m hatchling build -t wheel -d /tmp/wheel) \
    && /opt/sunbox/bin/pip install --no-deps /tmp/wheel/*.whl \
    && /opt/sunbox/bin/pip uninstall -y pip \
    && /opt/sunbox/bin/python -m compileall -q /opt/sunbox/lib

FROM python:3.13-slim-trixie@sha256:ffb752e139c0a19692a43af8d8523b274222dd68eebad5d583b45c2201c6e30a
# Mesa's software renderer, and glvnd, which finds NVIDIA's driver when the container runtime brings one along.
ARG EXTRAS=
# hadolint ignore=DL3008
RUN case " $EXTRAS " in *" ffmpeg "*) more=ffmpeg ;; *) more= ;; esac \
    && apt-get update \
    && apt-get install -y --no-install-recommends libegl1 libopengl0 libgl1-mesa-dri $more \
    && rm -rf /var/lib/apt/lists/* \
    && mkdir -p /usr/share/glvnd/egl_vendor.d \
    && printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "libEGL_nvidia.so.0"}}\n' \
        > /usr/share/glvnd/egl_vendor.d/10_nvidia.json \
    && useradd --uid 10001 --no-create-home --home-dir /data sunbox \
    && install -d -o sunbox -g sunbox /data
COPY --from=build /opt/sunbox /opt/sunbox
# Everything that is written lies under /data: assets, documents, and the compilers' caches.
ENV PATH=/opt/sunbox/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1 \
    NVIDIA_VISIBLE_DEVICES=all \
    NVIDIA_DRIVER_CAPABILITIES=graphics,compute,utility \
    HOME=/data \
    XDG_CACHE_HOME=/data/cache \
    MESA_SHADER_CACHE_MAX_SIZE=256M \
    __GL_SHADER_DISK_CACHE_PATH=/data/cache \
    SUNBOX_DATA_DIR=/data \
    SUNBOX_HOST=0.0.0.0 \
    SUNBOX_PORT=8000
USER 10001
# Of use where the same kind of processor renders, and in a volume that is new; other machines compile their own.
ARG WARM=
RUN if [ -n "$WARM" ]; then sunbox warm; fi
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s CMD ["python", "-m", "service.cli.health"]
ENTRYPOINT ["sunbox"]
CMD ["serve"]
