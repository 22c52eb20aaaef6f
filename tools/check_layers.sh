#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Checks that folders include only lower ones (doc/ has the architecture), that only blocks and the
# CUDA engine use GPU threads, and that every header compiles alone.
set -u
cd "$(dirname "$0")/../src/GPU_RVE" || exit 1
failed=0

complain() {    # complain <what is wrong>; reads the offending lines
  lines=$(cat)
  [ -z "$lines" ] && return 0
  echo "check_layers: $1"
  echo "$lines" | sed 's/^/    /'
  failed=1
}

# room <folder> <folders it may include>: every quoted include in the folder must begin with one of
# them. Headers of LAMMPS, which are included without a folder, are thus excluded.
room() {
  [ -d "$1" ] || return 0
  complain "$1 may include only: $2" <<END
$(grep -rnE '^[[:space:]]*#[[:space:]]*include[[:space:]]*"' "$1" | grep -vE "\"($(echo "$2" | tr ' ' '|'))/")
END
  # <fix.h> would be a header of LAMMPS too
  complain "$1 knows nothing of LAMMPS" <<END
$(grep -rnE 'LAMMPS_NS|#[[:space:]]*include[[:space:]]*<(lammps|fix|compute|atom|pointers|error|memory|domain|comm)\.h>' "$1")
END
}
room rve/core "rve/core"
room cuda "cuda rve/core"
room rve/physics "rve/physics rve/core"
room rve/block "rve/block rve/core"
room rve/algorithm "rve/algorithm rve/physics rve/core"
room rve/engine "rve/engine cuda rve/algorithm rve/block rve/physics rve/core"
room mpm "mpm cuda rve/core"
room macro "macro mpm rve/engine rve/core"
room capi "capi macro rve/engine cuda rve/core"
room field "field rve/core"

complain "styles see the interfaces of engine, mpm, macro and field, not the rooms below" <<END
$(grep -rnE '#[[:space:]]*include[[:space:]]*"rve/(physics|algorithm|block)/' ./*.h ./*.cpp lammps)
END
complain "lammps/ knows styles by state_readers, rve_columns and gpurveplugin only" <<END
$(grep -rnE '#[[:space:]]*include[[:space:]]*"(fix_(mpm|rve)|compute_rve|create_rve|dump_rve|random_field|rve_packings|write_rve)' lammps | grep -vE '^lammps/(state_readers|rve_columns|gpurveplugin)\.')
END
complain "the header of a style includes its base class and the standard library only" <<END
$(grep -nE '#[[:space:]]*include' fix_mpm.h fix_rve.h compute_rve_atom.h compute_rve_contact_local.h compute_rve_tangent.h create_rve.h dump_rve_grain.h random_field.h write_rve.h 2>/dev/null | grep -vE '"(fix|compute|command|dump_custom)\.h"|<[a-z_]+>')
END
complain "GPU threads and the CUDA runtime belong to rve/block, the room cuda, the CUDA engine (rve/engine/*.cu, *.cuh) and mpm/cuda_*.cu" <<END
$(grep -rnE '\<(threadIdx|blockIdx|blockDim|gridDim|__syncthreads|__syncwarp|__shared__|cuda[A-Z][A-Za-z]*)\>' . \
  --include='*.h' --include='*.cpp' --include='*.cu' --include='*.cuh' | grep -vE ':[0-9]+: *//' | grep -vE '^\./(cuda/|rve/(block/|engine/[^:]*\.cuh?:)|mpm/cuda_[a-z_]*\.cuh?:)')
END

# headers for AVX2 compile with flags for AVX2
case $(uname -m) in x86_64 | amd64) isa=-march=x86-64-v3 ;; *) isa= ;; esac
for header in $(find cuda rve mpm macro capi field -name '*.h' | sort); do
  complain "$header does not compile alone" <<END
$(echo "#include \"$header\"" | g++ -std=c++17 $isa -fopenmp -Wall -Wextra -Werror -fsyntax-only -I . -x c++ - 2>&1)
END
done

[ "$failed" = 0 ] && echo "check_layers: in order"
exit $failed
