# SPDX-License-Identifier: GPL-2.0-only
# install_packages <Debian package>... : installs missing packages. To be sourced (`.
# tools/packages.sh`), not run. On systems without dpkg it only names them.
install_packages() {
  command -v dpkg-query >/dev/null ||
    { echo "== no dpkg here; taking it that these are there: $*"; return 0; }
  missing=""
  for package; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q ' installed$' ||
      missing="$missing $package"
  done
  [ -n "$missing" ] || return 0
  echo "== installing:$missing"
  as_root=""
  [ "$(id -u)" = 0 ] || as_root=sudo
  # one process at a time, since apt refuses a second one
  (
    if command -v flock >/dev/null; then flock 9; fi
    $as_root apt-get -q update
    # shellcheck disable=SC2086  # a list of words
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y install \
      --no-install-recommends $missing
  ) 9>"${TMPDIR:-/tmp}/gpu_rve_packages.$(id -u)"
}
