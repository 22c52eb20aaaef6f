#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Measures the comments of C++ and CUDA code, folder by folder.

    python3 tools/prose.py [folder...]               prints one line of figures for each folder
    python3 tools/prose.py --worst 40 src            also lists 40 fragments
    python3 tools/prose.py --max-fragments 2 --max-wide 0 src unittest
                                                     exits with 1 if a folder exceeds a limit

A fragment is a comment that opens with a word which seldom begins a sentence with a subject ("Of",
"Whether", "What"; see OPENERS). Its share is taken over blocks: consecutive comment lines count
once. Wide lines have more than 100 columns. Files of more than 700 lines are listed, without limit.
"""

import argparse
import pathlib
import re
import sys

COLUMNS = 100
LONG_FILE = 700    # lines
SUFFIXES = ("*.h", "*.cpp", "*.cu", "*.cuh")
OPENERS = re.compile(
    r"^(What|Of|Whether|Who|Whose|Those|That|In which|Where|Which|One|As|Than|Nothing|None)\b")
COMMENT_LINE = re.compile(r"\s*///?<?\s*(.*)")
MEMBER_COMMENT = re.compile(r".*[;,{]\s*///<\s*(.*)")    # behind a declaration, on its line


class Figures:
    """Counts over the files of one folder."""

    def __init__(self, folder):
        self.folder = folder
        self.lines = self.blocks = self.wide = 0
        self.fragments = []      # "path:line: text" of each
        self.long_files = []     # "name lines" of each
        for path in sorted(path for suffix in SUFFIXES for path in folder.rglob(suffix)):
            self._add(path)

    def _add(self, path):
        lines = path.read_text(errors="replace").splitlines()
        self.lines += len(lines)
        self.wide += sum(len(line) > COLUMNS for line in lines)
        if len(lines) > LONG_FILE:
            self.long_files.append(f"{path.name} {len(lines)}")
        follows_comment = False
        for number, line in enumerate(lines, 1):
            found = COMMENT_LINE.match(line) or MEMBER_COMMENT.match(line)
            if found and not follows_comment and found.group(1):
                self.blocks += 1
                if OPENERS.match(found.group(1)):
                    self.fragments.append(f"{path}:{number}: {found.group(1)[:100]}")
            follows_comment = bool(re.match(r"\s*//", line))

    def percent(self):
        """Share of the comment blocks that open with a fragment [%]."""
        return 100.0 * len(self.fragments) / max(self.blocks, 1)

    def summary(self):
        return (f"{self.folder}: {self.lines} lines, {self.blocks} comment blocks, "
                f"{self.percent():.1f} % open with a fragment, "
                f"{self.wide} lines over {COLUMNS} columns, "
                f"files over {LONG_FILE} lines: {', '.join(self.long_files) or 'none'}")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", default=["src"], metavar="folder")
    parser.add_argument("--worst", type=int, default=0, metavar="N",
                        help="list the first N fragments of each folder")
    parser.add_argument("--max-fragments", type=float, metavar="PERCENT",
                        help="largest allowed share of fragments of a folder [%%]")
    parser.add_argument("--max-wide", type=int, metavar="N",
                        help="largest allowed number of wide lines of a folder")
    arguments = parser.parse_args()
    within_limits = True
    for folder in map(pathlib.Path, arguments.folders):
        if not folder.is_dir():
            parser.error(f"there is no folder {folder}")
        figures = Figures(folder)
        print(figures.summary())
        for fragment in figures.fragments[:arguments.worst]:
            print("  " + fragment)
        if arguments.max_fragments is not None and figures.percent() > arguments.max_fragments:
            print(f"{folder}: more than {arguments.max_fragments:g} % of the comments open with a "
                  "fragment; --worst N lists them")
            within_limits = False
        if arguments.max_wide is not None and figures.wide > arguments.max_wide:
            print(f"{folder}: more than {arguments.max_wide} lines exceed {COLUMNS} columns")
            within_limits = False
    return 0 if within_limits else 1


if __name__ == "__main__":
    sys.exit(main())
