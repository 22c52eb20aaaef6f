# SPDX-License-Identifier: GPL-2.0-only
"""The notebooks of examples/notebooks run and print their stored output, since bits and printed
numbers are the same everywhere.

    python3 test_notebooks.py <examples>        with gpu_rve, matplotlib, nbclient and ipykernel
"""

import copy
import pathlib
import sys
import unittest

import nbformat
from nbclient import NotebookClient

FOLDER = pathlib.Path(sys.argv.pop(1)).resolve() / "notebooks"
LARGEST = 200_000    # largest size of a notebook with its pictures [bytes]


def printed(cell):
    """Returns the text output of a cell and the number of its pictures."""
    pictures = [output for output in cell.outputs if "image/png" in output.get("data", {})]
    texts = [
        output.get("text", "") or output.get("data", {}).get("text/plain", "")
        for output in cell.outputs if output not in pictures
    ]
    return "".join(texts), len(pictures)


class Notebooks(unittest.TestCase):
    def test_they_print_what_they_have_stored(self):
        notebooks = sorted(FOLDER.glob("*.ipynb"))
        self.assertTrue(notebooks)
        for path in notebooks:
            with self.subTest(path.name):
                self.assertLess(path.stat().st_size, LARGEST)
                stored = nbformat.read(path, as_version=4)
                run = copy.deepcopy(stored)
                NotebookClient(run,
                               timeout=600,
                               kernel_name="python3",
                               resources={"metadata": {"path": str(FOLDER)}}).execute()
                for before, after in zip(stored.cells, run.cells):
                    if before.cell_type == "code":
                        self.assertEqual(printed(after), printed(before), before.source)


if __name__ == "__main__":
    unittest.main()
