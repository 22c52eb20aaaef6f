# SPDX-License-Identifier: GPL-2.0-only
"""Tests tools/bench_records.py and checks bench/results.

    python3 bench_records.py <repository>
"""

import json
import os
import sys
import tempfile
import unittest

REPOSITORY = sys.argv.pop(1)
sys.path.insert(0, os.path.join(REPOSITORY, "tools"))
import bench_records


def record(*rows):
    return {
        "machine": "none", "date": "2000-01-01", "commit": "0", "command": "true",
        "rows": list(rows)
    }


def row(metric, value, unit="s", details=None, **case):
    return {
        "case": case, "metric": metric, "value": value, "unit": unit,
        **({"details": details} if details else {})
    }


class Records(unittest.TestCase):
    def there_and_back(self, *rows):
        return bench_records.expand(json.loads(bench_records.text(record(*rows))))["rows"]

    def test_rows_are_those_that_were_written(self):
        # Metrics of a case are in the order of their names.
        rows = [
            row("steps", 10, "-", device="a", rves=1),
            row("wall", 1.5, device="a", rves=1),
            row("wall", 2.5, device="a", rves=1.0),
            row("wall", 3.5, device="a", details={"best": 3.25}),
            row("wall", 4.5, device="b", details={"best": 3.25}, rves=1)
        ]
        back = self.there_and_back(*rows)
        self.assertEqual([bench_records.line(some) for some in back],
                         [bench_records.line(some) for some in rows])

    def test_metrics_of_a_case_share_a_line(self):
        text = bench_records.text(
            record(row("a", 1, device="x"), row("b", 2, device="x"), row("a", 3, device="y")))
        self.assertEqual(len(text[text.index("[") :].splitlines()), 4)

    def test_plain_rows_can_be_read(self):
        plain = record(row("a", 1.0, device="x"))
        self.assertEqual(bench_records.expand(plain), plain)

    def test_digits(self):
        self.assertEqual(bench_records.rounded([1 / 3, {"n": 123456789}]),
                         [0.333333, {"n": 123456789}])
        whole = 1.23449999
        self.assertEqual(f"{bench_records.rounded(whole):.4g}", f"{whole:.4g}")

    def test_a_metric_has_one_unit(self):
        self.assertRaises(ValueError, bench_records.text, record(row("a", 1, "s"), row("a", 2,
                                                                                       "m")))

    def test_faults_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            bench_records.write(record(row("a", 1.0)), os.path.join(folder,
                                                                    "engine-H200-core.json"))
            self.assertEqual(bench_records.faults(folder), [])
            bench_records.write(record(row("a", 1.0)),
                                os.path.join(folder, "engine-H200-core-a7293ec.json"))
            with open(os.path.join(folder, "wide.json"), "w", encoding="utf-8") as stream:
                json.dump(record(row("a", 1.0)), stream, indent=1)
            with open(os.path.join(folder, "large.json"), "w", encoding="utf-8") as stream:
                stream.write(" " * bench_records.MOST_BYTES)
            self.assertEqual([fault.split()[0] for fault in bench_records.faults(folder)[:3]],
                             ["engine-H200-core-a7293ec.json:", "large.json:", "wide.json:"])
            self.assertIn("bytes", bench_records.faults(folder)[-1])

    def test_records_of_the_repository(self):
        self.assertEqual(bench_records.faults(os.path.join(REPOSITORY, "bench", "results")), [])


unittest.main()
