#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Prints the compute capabilities of the NVIDIA GPUs in this machine, each once, in CMake's form of
# architectures: 90 for an H200. Prints nothing without a GPU or a driver.
smi=$(command -v nvidia-smi) || smi=/usr/lib/wsl/lib/nvidia-smi
[ -x "$smi" ] || exit 0
"$smi" --query-gpu=compute_cap --format=csv,noheader 2>/dev/null |
  sed -n 's/^ *\([0-9][0-9]*\)\.\([0-9]\) *$/\1\2/p' | sort -nu
