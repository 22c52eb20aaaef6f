#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Runs check_<reader>.py with a Python that has its modules.
#
#   check.sh <ovito, vtk, plots or lammps> <root of the project> <folder of the run>
set -eu
reader=$1 root=$2 folder=$3
case $reader in
  ovito) modules="ovito numpy" ;;
  vtk) modules="vtk meshio numpy" ;;
  plots) modules="matplotlib numpy PIL" ;;
  lammps) modules="numpy" ;;
esac
export OVITO_GUI_MODE=0 QT_QPA_PLATFORM=offscreen PYTHONPATH="$root/tools:$root/examples/pictures" \
  PYTHONDONTWRITEBYTECODE=1
for python in "$(sh "$root/tools/pictures_python.sh" --find)" python3 /usr/bin/python3; do
  [ -n "$python" ] || continue
  if "$python" -c "import $(echo "$modules" | tr ' ' ',')" 2> "$folder/$reader.import"; then
    cd "$folder"
    exec "$python" "$root/unittest/pictures/check_$reader.py" "$root/tools"
  fi
done
echo "no Python here has the modules $modules: sh tools/pictures_python.sh makes one"
[ "${GPU_RVE_REQUIRE_PICTURES:-0}" = 1 ] && { cat "$folder/$reader.import"; exit 1; }
exit 77
