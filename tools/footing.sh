#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Runs the footing on a fresh Debian 12 machine: installs missing packages, builds lmp with the
# package, runs examples/footing/in.footing and draws its curve. Arguments go to lmp.
#
#   sh tools/footing.sh                  the default; about ten minutes on two cores at first,
#                                        and three more with the kernels of a GPU
#   sh tools/footing.sh -var h 0.25      a finer grid
stages=5
. "$(dirname "$0")/setup.sh"

# Only lmp is built; the kernels of the CPU take 900 s of a core, those of a GPU 400 s.
if [ "$preset" = cuda ]; then work=1400; else work=1000; fi
say "3 of $stages: building lmp; the first time $(minutes $work)"
cmake --build --preset "$preset" --target lmp

say "4 of $stages: running examples/footing/in.footing, $(minutes 70)"
cd "$root/examples/footing"
"$build/bin/lmp" -in in.footing "$@"

# Debian's matplotlib belongs to the system's Python, which may not be the first on the PATH.
for python in python3 /usr/bin/python3; do
  if "$python" -c 'import matplotlib' 2>/dev/null; then
    say "5 of $stages: drawing"
    exec "$python" plot_footing.py
  fi
done
say "no matplotlib for Python here: no plot is drawn (python3 plot_footing.py does it)"
