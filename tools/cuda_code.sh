#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Lists the targets of CUDA code in programs and libraries, one per line: binaries (sm_90: compute
# capability 9.0) and texts that a driver compiles at first use (compute_80: 8.0 and newer).
#
#   sh tools/cuda_code.sh build/cuda/bin/lmp
#
# It needs cuobjdump of the CUDA toolkit, on the PATH, in CUOBJDUMP, or in /usr/local/cuda/bin.
set -eu
[ $# -gt 0 ] || { sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 2; }
cuobjdump=${CUOBJDUMP:-$(command -v cuobjdump || echo /usr/local/cuda/bin/cuobjdump)}
[ -x "$cuobjdump" ] ||
  { echo "cuda_code: there is no cuobjdump on the PATH, in CUOBJDUMP or in /usr/local/cuda/bin" \
    >&2; exit 1; }
for file; do
  [ -f "$file" ] || { echo "cuda_code: there is no $file" >&2; exit 1; }
  # "ELF file    1: lmp.2.sm_90.cubin", "PTX file    1: lmp.1.sm_80.ptx"
  echo "$file: $("$cuobjdump" --list-elf --list-ptx "$file" 2>/dev/null |
    sed -n -e 's/^ELF file.*\.\(sm_[0-9a-z]*\)\.cubin$/\1/p' -e 's/^PTX file.*\.sm_\([0-9a-z]*\)\.ptx$/compute_\1/p' | sort -u | xargs)"
done
