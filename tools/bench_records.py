#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Reads and writes records of measurements, as they are in bench/results.

    python3 tools/bench_records.py FILE...             rewrites records in the compact form
    python3 tools/bench_records.py --check FOLDER      checks size, names and form of all records

A record is an object with `machine`, `date`, `commit`, `command` and `rows`. A row is an object
with `case`, `metric`, `value`, `unit` and, if there are any, `details`. In a file one line has all
metrics of a case, `units` has the unit of each metric, and `defaults` has the values of cases and
details that more than half of the rows share. A line leaves them out, and has null for a default
that its rows do not have. Numbers with a fraction have six significant digits, or more where
rounding them to the manual's four would differ. bench/bench_report.h writes the same form.

Exit status 1 if a record is wrong.
"""

import collections
import json
import os
import re
import sys

PARTS = ("case", "details")
MOST_BYTES = 1_000_000    # largest size of all records together


def rounded(value):
    """Returns the value with as many digits of each float as a record keeps."""
    if isinstance(value, float):
        for digits in range(6, 18):
            shorter = float(f"{value:.{digits}g}")
            if f"{shorter:.4g}" == f"{value:.4g}":
                return shorter
    if isinstance(value, dict):
        return {key: rounded(some) for key, some in value.items()}
    if isinstance(value, list):
        return [rounded(some) for some in value]
    return value


def line(value):
    """Returns JSON on one line with sorted keys. Equal texts are equal values of the same type."""
    return json.dumps(value, sort_keys=True, ensure_ascii=False, separators=(",", ":"))


def expand(record):
    """Returns the record with one row for each metric of each case, and all keys in each row."""
    defaults, units = record.get("defaults", {}), record.get("units", {})
    rows = []
    for row in record.get("rows", []):
        merged = (sorted({**defaults.get(part, {}), **row.get(part, {})}.items()) for part in PARTS)
        case, details = ({key: value
                          for key, value in items if value is not None} for items in merged)
        for metric, value in row.get("values", {row.get("metric"): row.get("value")}).items():
            unit = row.get("unit", units.get(metric, ""))
            rows.append({"case": case, "metric": metric, "value": value, "unit": unit})
            if details:
                rows[-1]["details"] = details
    return {
        **{key: value
           for key, value in record.items() if key not in ("defaults", "units")}, "rows": rows
    }


def defaults_of(dictionaries):
    """Returns the items that more than half of two or more dictionaries have."""
    count = collections.Counter(
        (key, line(value)) for dictionary in dictionaries for key, value in dictionary.items())
    return {
        key: json.loads(value)
        for (key, value), times in count.items() if 2 * times > len(dictionaries) > 1
    }


def differences(dictionary, defaults):
    """Returns the items that differ from the defaults, and null for a default without an item."""
    own = {
        key: value
        for key, value in dictionary.items()
        if key not in defaults or line(defaults[key]) != line(value)
    }
    return own | {key: None for key in defaults if key not in dictionary}


def text(record):
    """Returns the compact form of an expanded record."""
    rows = [rounded({"case": {}, "details": {}, **row}) for row in record["rows"]]
    defaults = {part: defaults_of([row[part] for row in rows]) for part in PARTS}
    units, lines, last = {}, [], None
    for row in rows:
        if units.setdefault(row["metric"], row["unit"]) != row["unit"]:
            raise ValueError(
                f"{row['metric']} has the units {units[row['metric']]} and {row['unit']}")
        own = {part: differences(row[part], defaults[part]) for part in PARTS}
        if own != last or row["metric"] in lines[-1]["values"]:
            lines.append({part: some for part, some in own.items() if some} | {"values": {}})
            last = own
        lines[-1]["values"][row["metric"]] = row["value"]
    head = {key: value for key, value in record.items() if key != "rows"}
    head |= {"defaults": {part: some for part, some in defaults.items() if some}, "units": units}
    header = "".join(f"{line(key)}: {line(head[key])},\n" for key in sorted(head))
    return "{\n" + header + '"rows": [' + ",".join("\n" + line(some) for some in lines) + "\n]}\n"


def read(path):
    """Returns the expanded record of a file."""
    with open(path, encoding="utf-8") as stream:
        return expand(json.load(stream))


def write(record, path):
    """Writes a record in the compact form. The file is replaced when all of it is written."""
    partial = str(path) + ".part"
    with open(partial, "w", encoding="utf-8") as stream:
        stream.write(text(record))
    os.replace(partial, path)


def faults(folder):
    """Returns one message for each error in the records of a folder."""
    found, size = [], 0
    for name in sorted(os.listdir(folder)):
        path = os.path.join(folder, name)
        size += os.path.getsize(path)
        if re.search(r"(?<![0-9a-z])(?=[a-f]*[0-9])[0-9a-f]{7,40}(?![0-9a-z])", name):
            found.append(
                f"{name}: the name has the hash of a commit; there is one record for each machine "
                "and suite"
            )
        with open(path, encoding="utf-8") as stream:
            content = stream.read()
        try:
            if text(expand(json.loads(content))) != content:
                found.append(
                    f"{name}: the form is not compact; run python3 tools/bench_records.py {path}")
        except (ValueError, KeyError) as error:
            found.append(f"{name}: {error!r}")
    if size > MOST_BYTES:
        found.append(
            f"{size} bytes are more than {MOST_BYTES}; remove superseded records and details that "
            "nothing reads"
        )
    return found


def main():
    words = sys.argv[1:]
    if words[:1] == ["--check"] and len(words) == 2:
        found = faults(words[1])
        print("\n".join(found) if found else "bench_records: in order")
        return 1 if found else 0
    if not words or words[0].startswith("-"):
        sys.exit(__doc__)
    for path in words:
        write(read(path), path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
