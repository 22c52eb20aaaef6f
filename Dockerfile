# SPDX-License-Identifier: GPL-2.0-only
# Debian 12 with lmp, the Python package and the examples, without a GPU engine. Page "Installation"
# of the manual has the commands. tools/try_container.sh builds this image and tries it.

# ---- the build: `docker build --target build` stops here, and `sh tools/test.sh` works in it
FROM debian:bookworm-slim AS build
WORKDIR /gpu_rve
COPY . .
# The footing is the test of the build.
RUN GPU_RVE_PRESET=host sh tools/footing.sh
RUN cmake --install build/host --prefix /opt/gpu_rve --component lmp
# Debian's Python allows packages of pip in a virtual environment only.
RUN . tools/packages.sh && install_packages python3-venv && \
    python3 -m venv --system-site-packages /opt/gpu_rve && \
    /opt/gpu_rve/bin/pip install . && /opt/gpu_rve/bin/gpu-rve-check

# ---- the image: libraries that the programs need when they run
FROM debian:bookworm-slim
RUN apt-get update && apt-get install -y --no-install-recommends openmpi-bin libopenmpi3 \
    libpng16-16 libfftw3-double3 libgomp1 python3 python3-numpy python3-matplotlib python3-cffi && \
    rm -rf /var/lib/apt/lists/*
COPY --from=build /opt/gpu_rve /opt/gpu_rve
# the name of the README; mpirun refuses root without the two variables
RUN ln -s lmp_gpu_rve /opt/gpu_rve/bin/lmp
ENV PATH=/opt/gpu_rve/bin:$PATH OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
WORKDIR /opt/gpu_rve/share/gpu_rve/examples/getting_started
CMD ["lmp", "-in", "in.first"]
