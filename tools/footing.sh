#!/bin/sh
# From a fresh Debian 12 machine to the footing: installs what is missing, builds lmp with the package in it, runs
# examples/footing/in.footing and draws its curve. Arguments go to lmp:
#
#   sh tools/footing.sh                  the default, minutes on two cores
#   sh tools/footing.sh -var h 0.25      a finer grid
. "$(dirname "$0")/setup.sh"

say "building lmp"
cmake --build --preset "$preset" --target lmp

say "running examples/footing/in.footing"
cd "$root/examples/footing"
"$build/bin/lmp" -in in.footing "$@"

# the matplotlib of the Debian package belongs to the system's Python, which need not be the first on the PATH
for python in python3 /usr/bin/python3; do
  if "$python" -c 'import matplotlib' 2>/dev/null; then
    say "drawing"
    exec "$python" plot_footing.py
  fi
done
say "no matplotlib for Python here: no plot is drawn (python3 plot_footing.py does it)"
