#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Checks what the manual and the README files quote against the repository.

* A quoted line of a log must be text of the source: fragments of three and more words between
  numbers, names and punctuation are searched in the string literals of src/GPU_RVE.
* A command `lmp -in FILE -var NAME ...` must name an existing script that defines NAME.
* Only the developers' pages and CONTRIBUTING.md name commits.

    python3 tools/check_manual.py

The exit status is 1 if something is wrong.
"""

import glob
import os
import re
import sys

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
DEVELOPERS = re.compile(r"doc/src/(architecture|dev_\w+)\.rst|CONTRIBUTING\.md")
# how a line of a log begins
LOG = re.compile(r"^\s+(WARNING: |ERROR: |ERROR on proc \d+: )?"
                 r"((fix|compute) (rve|mpm|rve/\S+) \S+|create_rve|write_rve|random_field|dump \S+): (.*)")
HASH = re.compile(r"(?<!\.)\b(?=[0-9a-f]*\d)(?=[0-9a-f]*[a-f])[0-9a-f]{7,40}\b")
COMMAND = re.compile(r"lmp\S* (?:.*? )?-in (\S+)([^`]*)")


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def literals():
    """Returns the string literals of the source, adjacent ones joined, numbers as blanks."""
    texts = []
    for path in glob.glob(os.path.join(ROOT, "src/GPU_RVE/**/*"), recursive=True):
        if not path.endswith((".h", ".cpp", ".cu", ".cuh")):
            continue
        source = re.sub(r"^\s*//.*$", "", read(path), flags=re.M)
        source = re.sub(r'"\s*\n\s*"', "", source)
        texts += re.findall(r'"((?:[^"\\\n]|\\.)*)"', source)
    return "\n".join(" ".join(re.sub(r"\{[^}]*\}", "{}", text).replace("\\n", " ").replace('\\"', '"').split())
                     for text in texts)


def fragments(message):
    """Returns the pieces of a message between numbers, units, names of files and punctuation."""
    message = re.sub(r"\[[^\]]*\]|'[^']*'|\S+\.\w{2,}|\S*\d\S*|\.\.\.", "|", message)
    return [" ".join(piece.split()) for piece in re.split(r"[|;:,.()>-]+ ?", message)
            if len(piece.split()) >= 3]


def with_gap(words):
    """Returns the words with one or two of them replaced by {}, in all ways."""
    return [words[:first] + ["{}"] + words[first + gap:]
            for gap in (1, 2) for first in range(len(words) - gap + 1)]


def is_text(piece, source):
    """True if the source has the fragment, apart from one or two values in place of {}."""
    once = with_gap(piece.split())
    return any(" ".join(words) in source
               for words in [piece.split()] + once + [twice for words in once if len(words) > 3
                                                      for twice in with_gap(words)])


def scripts(name, page):
    """Returns the scripts that a command of a page can mean."""
    beside = os.path.join(os.path.dirname(page), name)
    if os.path.isfile(beside):
        return [beside]
    return glob.glob(os.path.join(ROOT, "examples/*", os.path.basename(name)))


def defines(script, name):
    return re.search(rf"^variable\s+{re.escape(name)}\s|\"variable {re.escape(name)} "
                     rf"|\$\{{{re.escape(name)}\}}|v_{re.escape(name)}\b", read(script), re.M)


def check(page, source):
    """Returns what is wrong in a page, as lines."""
    short = os.path.relpath(page, ROOT)
    wrong = []
    for number, line in enumerate(read(page).splitlines(), 1):
        place = f"{short}:{number}"
        match = LOG.match(line)
        if match:
            wrong += [f"{place}: the source has no text '{piece}'"
                      for piece in fragments(match[5]) if not is_text(piece, source)]
        if not DEVELOPERS.match(short):
            wrong += [f"{place}: the commit {name} belongs to the developers' pages"
                      for name in HASH.findall(line)]
        match = COMMAND.search(line)
        if match and not re.search(r"[<$*]", match[1]):
            found = scripts(match[1].strip("`'\","), page)
            if re.match(r"^(in|study)\.(my|problem$)", os.path.basename(match[1])):
                continue
            if not found:
                wrong.append(f"{place}: there is no script {match[1]}")
            wrong += [f"{place}: {os.path.basename(match[1])} has no variable {name}"
                      for name in re.findall(r"-var (\w+)", match[2])
                      if found and not any(defines(script, name) for script in found)]
    return wrong


def main():
    pages = [os.path.join(ROOT, name) for name in ("README.md", "CONTRIBUTING.md")]
    pages += glob.glob(os.path.join(ROOT, "doc/src/*.rst"))
    pages += glob.glob(os.path.join(ROOT, "examples/**/README.md"), recursive=True)
    pages += glob.glob(os.path.join(ROOT, "examples/*/in.*"))
    pages += glob.glob(os.path.join(ROOT, "examples/*/study.*[!y]"))
    source = literals()
    wrong = [line for page in sorted(pages) if not page.endswith(".py")
             for line in check(page, source)]
    print("\n".join(wrong) or f"check_manual: {len(pages)} files in order")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
