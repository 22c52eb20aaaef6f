#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Checks that tools/setup.sh installs every Debian package that a build used.

    check_packages.py BUILD_FOLDER

A machine that has a package already hides that the set-up forgot it. This check compares the files that the
compiler and CMake read (Ninja's dependencies, paths in CMakeCache.txt) with the packages in the list of
tools/setup.sh, their dependencies, and Debian's essential packages. Files that no package owns are ignored.
The exit status is 1 if a package is missing in the list, and 0 without dpkg.
"""
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Packages of programs that a build uses only where they are installed.
OPTIONAL = {"ccache", "git", "lld", "mold", "pkg-config", "pkgconf", "pkgconf-bin", "python3-sphinx"}


def output_of(*command):
    return subprocess.run(command, capture_output=True, text=True).stdout


def listed_packages():
    """Returns the packages that tools/setup.sh installs."""
    text = (ROOT / "tools/setup.sh").read_text().replace("\\\n", " ")
    return re.search(r"^install_packages (.*)$", text, re.M).group(1).split()


def installed_packages():
    """Returns for each installed package its dependencies, and the set of packages that every system has."""
    fields = "${Package}\t${Essential}\t${Priority}\t${Provides}\t${Depends}, ${Pre-Depends}\n"
    depends, base, providers = {}, set(), {}
    for line in output_of("dpkg-query", "-W", "-f", fields).splitlines():
        name, essential, priority, provides, needs = line.split("\t")
        names = [re.split(r"[ :(]", word.strip())[0] for word in re.split(r"[,|]", needs) if word.strip()]
        depends[name] = depends.get(name, []) + names
        if essential == "yes" or priority == "required":
            base.add(name)
        for word in provides.split(","):
            if word.strip():
                providers.setdefault(re.split(r"[ (]", word.strip())[0], []).append(name)
    for virtual, names in providers.items():
        depends.setdefault(virtual, names)
    return depends, base


def closure(packages, depends):
    """Returns the packages and all that they depend on."""
    found, open_ones = set(), list(packages)
    while open_ones:
        name = open_ones.pop()
        if name not in found:
            found.add(name)
            open_ones += depends.get(name, [])
    return found


def files_of_build(build):
    """Returns the files outside of the repository that the build read."""
    files = set(re.findall(r"^ +(/\S+)$", output_of("ninja", "-C", str(build), "-t", "deps"), re.M))
    cache = (build / "CMakeCache.txt").read_text()
    files |= set(re.findall(r"^[^/#\n][^:\n]*:(?:FILEPATH|PATH|STRING|INTERNAL)=(/usr/\S+)$", cache, re.M))
    return {str(pathlib.Path(f).resolve()) for f in files if f.startswith("/usr/") and pathlib.Path(f).is_file()}


def owners(files):
    """Returns for each file the Debian package that owns it."""
    found = {}
    files = sorted(files)
    for first in range(0, len(files), 500):
        for line in output_of("dpkg", "-S", *files[first:first + 500]).splitlines():
            packages, _, path = line.partition(": ")
            if path:
                found[path] = packages.split(",")[0].split(":")[0]
    return found


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    if not shutil.which("dpkg-query"):
        print("check_packages: no dpkg here, nothing is checked")
        return
    depends, base = installed_packages()
    known = closure(listed_packages(), depends) | closure(base, depends)
    known |= OPTIONAL
    files = files_of_build(pathlib.Path(sys.argv[1]))
    forgotten = {}
    for path, package in owners(files).items():
        if package not in known:
            forgotten.setdefault(package, path)
    for package, path in sorted(forgotten.items()):
        print(f"check_packages: the build used {path} of {package}, which tools/setup.sh does not install")
    if not files:
        sys.exit(f"check_packages: {sys.argv[1]} has no files of the system, is it a build?")
    print(f"check_packages: {len(files)} files of the system, {len(forgotten)} packages missing in tools/setup.sh")
    sys.exit(1 if forgotten else 0)


main()
