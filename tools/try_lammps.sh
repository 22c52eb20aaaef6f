#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Tries the package with other releases of LAMMPS. For each tree the script builds lmp, the plugin
# with a plain LAMMPS, and the tests that need LAMMPS. It runs a short form of every example in both
# and compares all output files with those of the reference byte by byte, except restart files and
# pictures, which depend on the release. Then it runs the tests with the labels lammps and golden.
# It prints a table; the exit status is 0 only if everything agrees.
#
#   sh tools/try_lammps.sh <LAMMPS tree>...
#   sh tools/try_lammps.sh --examples <LAMMPS tree>...     without the tests
#   sh tools/try_lammps.sh                                 only the reference: plugin against lmp
#   sh tools/try_lammps.sh --check                         whether all examples have a short form
#
# The reference is the release with which the package is developed, LAMMPS 4Feb2025
# (tools/get_lammps.sh), in build/host. A tree is built in build/lammps-<release>, whose folder
# `out` has output and logs of the examples. The set-up is that of footing.sh.
set -eu
with_tests=yes
if [ "${1:-}" = --examples ]; then
  with_tests=no
  shift
fi
# Lines have name, folder and command of each run; `lmp` is the tested executable, with its own log
# and screen files. A command may make several runs, which find each other's files. Results of
# LAMMPS' own pair style are not compared, since its last digits depend on the release, nor are the
# points of the plate in restart, whose mass is LAMMPS' sphere. Every script in.* of examples must
# be here.
short_runs() {
  cat << 'END'
uniaxial        element_tests           lmp -in in.element
shear           element_tests           lmp -in in.element -var test shear -var format double
biaxial         element_tests           lmp -in in.element -var test biaxial -var format fast
triaxial        element_tests           lmp -in in.triaxial -var format fast
batch           element_tests           printf '1\n1 1\n' > path_of && printf '1\n1 0\n' > packing_of && lmp -in in.element_test -var most 200
undrained       element_tests           lmp -in in.triaxial -var test undrained -var format fast
tangent         tangent                 lmp -in in.tangent -var strain 0.003
sphere_packings sphere_packings         lmp -in in.sphere_packings -var mu 0
steady_shear    steady_shear            lmp -in in.steady_shear -var grains 50 -var strain 0.02
footing_short   footing                 lmp -in in.footing -var h 1 -var grains 50 -var settlement 0.02
overview        footing                 lmp -in in.overview -var grains 50 -var settlement 0.0005
footing         footing                 lmp -in study.footing -var h 1 -var grains 50 -var stop 10 -var frames 2
footing_full    footing                 lmp -in study.footing -var h 1 -var grains 50 -var stop 5 -var domain full -var ground mirrored -var preset standard
footing_drawn   footing                 lmp -in study.footing -var h 1 -var grains 50 -var stop 5 -var ground different -var packings 2 -var prep 0.3 -var thickness 0.1
footing_elastic footing                 lmp -in study.footing -var h 0.5 -var model elastic -var stop 40 -var frames 1
footing_ranks   footing                 lmp_ranks -in study.footing -var h 1 -var grains 50 -var stop 10 -var balance 4
random_field    random_field            lmp -in in.random_field -var h 0.1
random_footing  random_footing          lmp -in in.random_footing -var h 1 -var grains 50 -var seeds 4 -var within 0.02 -var stop 5
mirrored        random_footing          lmp -in in.random_footing -var h 1 -var grains 50 -var seeds 4 -var within 0.02 -var stop 5 -var ground mirrored
tresca          strip_footing           lmp -in in.strip_footing -var law tresca -var h 0.5 -var duration 0.2
mohr_coulomb    strip_footing           lmp -in in.strip_footing -var h 0.5 -var duration 0.2
undrained       undrained_footing       lmp -in in.undrained_footing -var h 0.5 -var duration 0.1
undrained_clay  undrained_footing       lmp -in in.undrained_footing -var h 0.5 -var duration 0.1 -var ground clay
consolidation   consolidation           lmp -in in.consolidation -var h 0.1 -var T 0.02
retaining_wall  retaining_wall          lmp -in in.retaining_wall -var h 0.5 -var duration 0.05
biaxial_bands   biaxial_specimen        lmp -in in.biaxial_specimen -var strain 0.001
triaxial_rough  triaxial_specimen       lmp -in in.triaxial_specimen -var strain 0.001
triaxial_round  triaxial_axisymmetric   lmp -in in.triaxial_axisymmetric -var strain 0.001
circle          circular_footing        lmp -in in.circular_footing -var d_end 0.02
footing_3d      footing_3d              lmp -in in.footing_3d -var h 1 -var d_end 0.02
specimen        finite_elements         lmp -in in.specimen -var strain 0.0002
narrow_cells    narrow_cells            lmp -in in.narrow_cells -var copies 1 -var strain 0.05
paths           element_tests           lmp -in in.paths
strength        howto                   lmp -in in.factor_of_safety -var n 4
collapse_short  column_collapse         lmp -in in.column_collapse -var h 0.5 -var periods 0.2
collapse        column_collapse         lmp -in study.column_collapse -var a 1 -var h 0.25 -var periods 0.5
collapse_grains column_collapse         lmp -in study.column_collapse -var law rve -var a 1 -var h 0.5 -var grains 50 -var periods 0.2
collapse_space  column_collapse         lmp -in in.column_collapse_3d -var h 0.25 -var periods 0.5
slope_short     slope                   lmp -in in.slope -var n 4
slope           slope                   lmp -in study.slope -var n 4 -var waves 5
elastic         strip_footing           lmp -in in.strip_footing -var law elastic -var h 0.5 -var duration 0.2
crosscheck      crosscheck              lmp -in in.prepare && lmp -in in.grains_in_rve -var start start.rve -var drive shear -var rate 0.05 -var out rve && lmp -in in.grains_in_lammps -var start start.data -var drive shear -var rate 0.05 -var out lammps && rm lammps.contacts lammps.grains
states          validation              lmp -in in.element -var test biaxial -var steps 1000
ensemble        validation              lmp -in in.ensemble -var seeds 3 -var grains 50 -var strain 0.002 -var rows 10
rotation        validation/objectivity  lmp -in in.shear && lmp -in in.rotation -var packing sheared.rve -var turns 0.1
packing         validation/packing      lmp -in in.packing -var seeds 2 -var preparation "void_ratio 0.180" -var pressure 2e4
deviations      validation/deviations   lmp -in in.engine
first           getting_started         lmp -in in.first
element         getting_started         lmp -in in.element && lmp -in in.element_continued
problem         getting_started         lmp -in in.problem && lmp -in in.problem_continued
spheres         getting_started         lmp -in in.spheres -var grains 100 -var steps 50
wall            getting_started         lmp -in in.wall -var h 0.5 -var grains 50 -var duration 0.4
pile            getting_started         lmp -in in.pile -var grains 50 -var duration 0.08
cyclic_shear    howto                   lmp -in in.cyclic_shear -var grains 100 -var seeds 1 -var ratio 0.25 -var cycles 3
isotropic_state howto                   lmp -in in.isotropic_state -var grains 100 -var seeds 2
free_surface    howto                   lmp -in in.free_surface -var a 0.5 -var grains 50 -var time 0.2
grading         howto                   lmp -in in.grading -var grains 300 -var steps 50
softness        howto                   lmp -in in.softness -var E 7e8 -var grains 50 -var seeds 2 -var steps 50
excavate        howto                   lmp -in in.excavate -var grains 50
grains          howto                   lmp -in in.grains -var grains 50
initial_stress  howto                   lmp -in in.initial_stress -var grains 50 -var h 1
soils           howto                   lmp -in in.soils -var grains 50
stress_paths    howto                   lmp -in in.stress_paths
pictures        pictures                lmp -in in.pictures -var steps 10 -var frames 1
restart         restart                 lmp -in in.press && lmp -in in.continue && for file in points.*; do awk '$2 != 2' "$file" > "soil.$file" && rm "$file"; done
job             restart                 lmp -in in.job && lmp -in in.job -var from restart_one && for file in points.*; do awk '$2 != 2' "$file" > "soil.$file" && rm "$file"; done
END
}
unknown=0
for script in $(cd "$(dirname "$0")/../examples" && find . -name 'in.*' | sed 's|^\./||'); do
  short_runs | awk -v folder="${script%/*}" -v name="${script##*/}" \
    '$2 == folder && index($0, "-in " name) {found = 1} END {exit !found}' ||
    { echo "examples/$script has no short run in tools/try_lammps.sh"; unknown=1; }
done
[ $unknown = 0 ] || exit 1
[ "${1:-}" != --check ] || exit 0

given=$#
for tree; do
  [ -f "$tree/src/version.h" ] ||
    { echo "$tree is not a LAMMPS source tree: it has no src/version.h"; exit 2; }
  set -- "$@" "$(cd "$tree" && pwd)"    # setup.sh changes the folder
done
shift "$given"

unset LAMMPS_SOURCE_DIR
GPU_RVE_PRESET=host
stages=2    # of the set-up
. "$(dirname "$0")/setup.sh"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
  OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1

# run_examples <build tree> <lmp or plugin>: into <build tree>/out/<lmp or plugin>/<name>; prints
# the names of those that failed
run_examples() {
  out=$1/out/$2
  executable=$1/bin/lmp
  [ "$2" = lmp ] || executable=$1/bin/lmp_plain
  rm -rf "$out"
  mkdir -p "$out"
  short_runs | while read -r name folder command; do
    cp -R examples "$out/$name"
    (
      cd "$out/$name/$folder"
      [ "$2" = lmp ] || export LAMMPS_PLUGIN_PATH="$plugin_folder"
      lmp() { OMP_NUM_THREADS=1 "$executable" -log none -screen log.screen "$@"; }
      lmp_ranks() { OMP_NUM_THREADS=1 mpiexec -np 2 "$executable" -log none -screen log.screen \
        "$@"; }
      eval "$command" < /dev/null > log.said 2>&1
    ) || echo "$name"
    find "$out/$name" -name 'log.*' -type f ! -name log.screen ! -name log.said -delete
  done
}
# compare <folder of examples> <folder of the reference>: prints names of those whose files differ
compare() {
  short_runs | while read -r name folder command; do
    diff -rq -x 'log.*' -x '*.restart*' -x 'restart_*' -x '*.png' "$1/$name" \
      "$2/$name" > "$1/$name.differences" 2>&1 || echo "$name"
  done
}
count() { printf '%s' "$1" | grep -c . || true; }

all=$(short_runs | wc -l)
failed=0
table="release      compiles  lmp        plugin     bits of lmp  of the plugin  tests"
row() { table="$table
$(printf '%-12s %-9s %-10s %-10s %-12s %-14s %s' "$@")"; }

# try_tree <build tree> <release>
try_tree() {
  here=$1 release=$2 tests="not run" verdict=passed
  plugin_folder=$(dirname "$(find "$here" -name gpurveplugin.so | head -1)")
  say "$release: examples in lmp"
  in_lmp=$(run_examples "$here" lmp)
  say "$release: examples in the plugin"
  in_plugin=$(run_examples "$here" plugin)
  bits_lmp=$(compare "$here/out/lmp" "$reference/out/lmp")
  bits_plugin=$(compare "$here/out/plugin" "$reference/out/lmp")
  for what in "in lmp:$in_lmp" "in the plugin:$in_plugin" "other bits in lmp:$bits_lmp" \
    "other bits in the plugin:$bits_plugin"; do
    [ -z "${what#*:}" ] || { failed=1; say "$release: failed $what; see $here/out"; }
  done
  if [ $with_tests = yes ] && [ "$here" != "$reference" ]; then
    say "$release: tests"
    ctest --test-dir "$here" -L '^(lammps|golden)$' --output-on-failure > "$here/out/tests" 2>&1 ||
      { verdict=FAILED; failed=1; grep -A100 'The following tests' "$here/out/tests" || true; }
    tests="$verdict: $(sed -n 's/^\(.*% tests passed.*\)$/\1/p' "$here/out/tests")"
  fi
  row "$release" yes "$((all - $(count "$in_lmp"))) of $all" \
    "$((all - $(count "$in_plugin"))) of $all" \
    "$((all - $(count "$bits_lmp"))) of $all" "$((all - $(count "$bits_plugin"))) of $all" "$tests"
}

release_of() { sed -n 's/.*LAMMPS_VERSION "\(.*\)".*/\1/p' "$1/src/version.h" | tr -d ' '; }

reference=$build
say "building the reference"
cmake --build "$build" --target lmp lmp_plain gpurveplugin
try_tree "$build" "4Feb2025"

for tree; do
  release=$(release_of "$tree")
  here=$root/build/lammps-$release
  say "building with LAMMPS $release"
  targets="lmp lmp_plain gpurveplugin"
  [ $with_tests = no ] || targets="$targets unittest/lammps/all unittest/golden/all"
  # warnings are errors in the preset
  # shellcheck disable=SC2086  # a list of words
  if cmake --preset host -B "$here" -D "LAMMPS_SOURCE_DIR=$tree" &&
    cmake --build "$here" --target $targets; then
    try_tree "$here" "$release"
  else
    failed=1
    row "$release" NO - - - - -
  fi
done
printf '\n%s\n' "$table"
exit $failed
