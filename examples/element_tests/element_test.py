#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Element tests from a table: all tests on disks as one batch, all tests on spheres as another, an RVE each.

    python3 element_test.py laboratory.csv               runs, writes, draws, and compares with the baseline
    python3 element_test.py laboratory.csv --update      makes what comes out the baseline

The table has a row for each test: its name, its path (one of laboratory.paths, which lies beside it; the manual: fix rve), its packing, and, if wanted, any
parameters of the material by their keywords (friction, kn, ...), which replace those of the packing; a field that is empty replaces nothing. Files are looked for
from the folder of the table on.

Writes into laboratory.out (--out): NAME.csv for each test, tests.h5 with all of them in the layout of GrainLearning's data sets, and curves.png. Exits with 0 if all
tests have ended and none differs from the baseline (laboratory.baseline/NAME.csv), with 1 if one does, with 2 if something cannot be run.

Needs numpy; h5py for tests.h5 and matplotlib for curves.png (Debian: python3-h5py, python3-matplotlib), and the package gpu_rve where a table changes materials.
Units are those of the packings. Stresses and strains are tension (extension) positive as everywhere, p, q, axial and volumetric strain compression positive.
"""

import argparse
import csv
import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
REPOSITORY = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(REPOSITORY, "tools"))
import dumps  # noqa: E402  reads LAMMPS' dumps

AXES = {2: "xy", 3: "xyz"}
TENSORS = {"contact_fabric": "a_c", "fn_fabric": "a_n", "ft_fabric": "a_t"}
# What each test has beside stresses, strains and anisotropies. Energies [force length]: work = changes of elastic and kinetic + losses
PLAIN = ["p", "q", "void_ratio", "coordination", "sliding", "inertial", "fn_mean", "servo_error", "path_stage", "path_cycles", "work", "elastic", "kinetic",
         "loss_friction", "loss_damping", "loss_viscous"]
DIGITS = 6    # of the files


class Failure(Exception):
    """Something cannot be run; the text says what and where."""


def components(dimension, symmetric=True):
    """Names of the components of a tensor: xx yy xy, or in space xx yy zz xy xz yz."""
    axes = AXES[dimension]
    pairs = [(a, b) for a in axes for b in axes]
    return [a + b for a, b in sorted(pairs, key=lambda ab: ab[0] != ab[1]) if not symmetric or a <= b]


class Test:
    """A row of the table."""

    def __init__(self, name, path, packing, material=None):
        self.name, self.path, self.packing = name, path, packing
        self.material = {keyword: float(value) for keyword, value in (material or {}).items()}
        self.parameters = {}    # all of the material, by their words in packing files
        self.columns = None    # what came out, by name, compression positive where it says so
        self.problem = None    # why it has not come to its end


def read_table(file):
    """Tests of a table. Raises Failure with line and column of what is wrong."""
    tests = []
    with open(file, newline="", encoding="utf-8") as stream:
        rows = csv.DictReader(line for line in stream if not line.startswith("#"))
        for column in ("name", "path", "packing"):
            if column not in (rows.fieldnames or []):
                raise Failure(f"{file} has no column {column}; it has {', '.join(rows.fieldnames or ['none'])}")
        for number, row in enumerate(rows, 1):
            where = f"{file}, test {number}"
            if None in row or None in row.values():
                raise Failure(f"{where}: it must have {len(rows.fieldnames)} fields")
            row = {column: value.strip() for column, value in row.items()}
            name = row.pop("name")
            if not re.fullmatch(r"[\w.+-]+", name):
                raise Failure(f"{where}: the name '{name}' must have letters, digits, '.', '+', '-' and '_' only: files have it")
            if name in (test.name for test in tests):
                raise Failure(f"{where}: the name {name} is taken by a test before")
            path, packing = row.pop("path"), row.pop("packing")
            try:
                tests.append(Test(name, path, packing, {keyword: value for keyword, value in row.items() if value}))
            except ValueError as problem:
                raise Failure(f"{where}, {name}: a parameter of the material is no number: {problem}") from None
    if not tests:
        raise Failure(f"{file} has no test")
    return tests


def path_names(file):
    """Names of the paths of a file, in their order."""
    with open(file, encoding="utf-8") as stream:
        return re.findall(r"\bpath\s+(\S+)", re.sub(r"#.*", "", stream.read()))


def dimension_of(packing):
    with open(packing, encoding="utf-8") as stream:
        text = stream.read(4000)
    return 3 if re.search(r"^\s*dimension\s+3", text, re.M) else 2


def parameters_of(packing):
    """The material of a packing file: words and numbers."""
    with open(packing, encoding="utf-8") as stream:
        section = re.search(r"^material\b(.*?)^cell\b", re.sub(r"#.*", "", stream.read()), re.M | re.S)
    return {word: float(number) for word, number in re.findall(r"^\s*(\w+)\s+([-+.\de]+)\s*$", section.group(1), re.M)}


def find_lmp(given):
    """The executable to run, `given` or the newest that was built."""
    built = glob.glob(os.path.join(REPOSITORY, "build", "*", "bin", "lmp"))
    found = shutil.which(given or max(built, key=os.path.getmtime, default="lmp"))
    if not found:
        raise Failure(f"no executable {given or 'in build/*/bin/lmp or on the PATH'}: build the package, or give one with --lmp")
    return os.path.abspath(found)


def import_gpu_rve():
    """The package that reads and writes packings: an installed one, or that of this tree with the newest library that was built."""
    built = glob.glob(os.path.join(REPOSITORY, "build", "*", "lib", "librve.so"))
    if built:
        os.environ.setdefault("GPU_RVE_LIBRARY", max(built, key=os.path.getmtime))
    sys.path.append(os.path.join(REPOSITORY, "python"))
    try:
        import gpu_rve
    except ImportError as problem:
        raise Failure(f"a table that changes materials needs the package gpu_rve (in the repository: pip install .): {problem}") from None
    return gpu_rve


def packing_files(tests, folder, scratch):
    """Packing files of the tests, each once, and the number of the file of each test. Those with another material are written into `scratch`."""
    files, numbers, known = [], [], {}
    for test in tests:
        key = (test.packing, tuple(sorted(test.material.items())))
        if key not in known:
            file = os.path.join(folder, test.packing)
            if test.material:
                gpu_rve = import_gpu_rve()
                packing = gpu_rve.Packing.read(file)
                try:
                    for keyword, value in test.material.items():
                        packing[keyword] = value
                except gpu_rve.Error as problem:
                    raise Failure(f"test {test.name}: {problem}") from None
                file = os.path.join(scratch, f"{len(files)}.rve")
                packing.write(file)
            known[key] = len(files)
            files.append(file)
        numbers.append(known[key])
    return files, numbers


def write_numbers(file, numbers):
    with open(file, "w", encoding="utf-8") as stream:
        stream.write(f"{len(numbers)}\n" + "".join(f"{k} {number}\n" for k, number in enumerate(numbers, 1)))


def anisotropy(tensor, stress, dimension):
    """Size of a tensor without trace, sqrt(3/2 a:a), in the plane sqrt(1/2 a:a); negative where it is large across the largest compression."""
    parts = components(dimension)
    weight = {part: 1.0 if part[0] == part[1] else 2.0 for part in parts}
    size = np.sqrt((1.5 if dimension == 3 else 0.5) * sum(weight[ab] * tensor[ab]**2 for ab in parts))
    mean = sum(stress[a + a] for a in AXES[dimension]) / dimension
    along = sum(weight[ab] * tensor[ab] * ((mean if ab[0] == ab[1] else 0.0) - stress[ab]) for ab in parts)
    return np.where(along < 0.0, -size, size)


def derived(raw, dimension):
    """The columns of a test from those of compute rve/atom."""
    axes, parts = AXES[dimension], components(dimension)
    gradient = np.array([[raw[f"def_{a}{b}"] for b in axes] for a in axes]).transpose(2, 0, 1)
    stress = {ab: raw["s" + ab] for ab in parts}
    columns = {"time": raw["time"]}
    columns["axial"] = -np.log(gradient[:, -1, -1])    # of the last axis
    columns["volumetric"] = -np.log(np.linalg.det(gradient))
    for k, a in enumerate(axes):
        columns["e_" + a] = -np.log(gradient[:, k, k])
    for ab in parts[dimension:]:
        a, b = axes.index(ab[0]), axes.index(ab[1])
        columns["e_" + ab] = gradient[:, a, b] / gradient[:, b, b]
    columns.update({"s_" + ab: stress[ab] for ab in parts})
    columns.update({name: raw[name] for name in PLAIN})
    for tensor, name in TENSORS.items():
        columns[name] = anisotropy({ab: raw[f"{tensor}_{ab}"] for ab in parts}, stress, dimension)
    return columns


def run_batch(tests, dimension, folder, paths, out, options):
    """Runs tests on grains of one dimension together, and fills their columns."""
    lmp = find_lmp(options.lmp)
    names = path_names(paths)
    asked = PLAIN + ["s" + ab for ab in components(dimension)] + ["def_" + ab for ab in components(dimension, False)]
    asked += [f"{tensor}_{ab}" for tensor in TENSORS for ab in components(dimension)] + ["path_ended", "status"]
    with tempfile.TemporaryDirectory() as scratch:
        files, packing_of = packing_files(tests, folder, scratch)
        for test, number in zip(tests, packing_of):
            test.parameters = parameters_of(files[number])
        write_numbers(os.path.join(scratch, "path_of"), [names.index(test.path) + 1 for test in tests])
        write_numbers(os.path.join(scratch, "packing_of"), packing_of)
        log = os.path.join(out, f"log.{dimension}d")
        variables = {
            "tests": len(tests), "paths": paths, "packings": " packings ".join([files[0]] + ([" ".join(files[1:])] if files[1:] else [])),
            "path_of": os.path.join(scratch, "path_of"), "packing_of": os.path.join(scratch, "packing_of"), "columns": " ".join(asked),
            "out": os.path.join(scratch, "tests"), "units": options.units, "step": options.step, "dt": options.dt, "format": options.format,
            "device": options.device, "every": options.every, "most": options.most}
        command = [lmp, "-in", os.path.join(HERE, "in.element_test"), "-screen", "none", "-log", log]
        for name, value in variables.items():
            command += ["-var", name, str(value)]
        # one process needs no daemon of Open MPI
        done = subprocess.run(command, cwd=folder, env=dict(os.environ, OMPI_MCA_ess_singleton_isolated="1"))
        if done.returncode != 0:
            with open(log, encoding="utf-8") as stream:
                said = [line.strip() for line in stream if line.startswith("ERROR")]
            raise Failure(f"{' '.join(said) or 'lmp has failed'} ({log})")
        frames = list(dumps.frames(os.path.join(scratch, "tests.dump")))
        end = dumps.last_frame(os.path.join(scratch, "tests.end.dump"))
    if end.step != frames[-1].step:
        frames.append(end)
    column = {name: f"c_rve[{k}]" for k, name in enumerate(asked, 1)}
    for k, test in enumerate(tests):
        ended = np.array([frame[column["path_ended"]][k] for frame in frames])
        # the first row behind the end has the state of the end
        rows = frames[:int(np.argmax(ended)) + 1] if ended.any() else frames
        raw = {name: np.array([frame[column[name]][k] for frame in rows]) for name in asked}
        raw["time"] = np.array([frame.time for frame in rows])
        test.columns = derived(raw, dimension)
        if not ended.any():
            status = int(raw["status"][-1])
            test.problem = f"its RVE has failed with status {status} (compute rve/atom)" if status else f"it has not ended in {options.most} steps (--most)"


def run(tests, folder, paths, out, options):
    """Runs all tests, those of a dimension together; fills their columns and problems. Raises Failure before anything runs if a file or a path is missing."""
    if not os.path.exists(paths):
        raise Failure(f"there is no file of paths {paths}")
    names = path_names(paths)
    batches = {}
    for test in tests:
        if test.path not in names:
            raise Failure(f"test {test.name}: {paths} has no path '{test.path}'; it has {', '.join(names)}")
        packing = os.path.join(folder, test.packing)
        if not os.path.exists(packing):
            raise Failure(f"test {test.name}: there is no packing {packing}")
        batches.setdefault(dimension_of(packing), []).append(test)
    os.makedirs(out, exist_ok=True)
    for dimension, batch in sorted(batches.items()):
        run_batch(batch, dimension, folder, paths, out, options)


def energy_error(test):
    """Work that is neither stored nor lost, the largest over the rows, over all work that was put in and taken out [-]."""
    change = {name: test.columns[name] - test.columns[name][0] for name in PLAIN[-6:]}
    left = change["work"] - sum(change[name] for name in PLAIN[-5:])
    return np.abs(left).max() / max(np.abs(np.diff(test.columns["work"])).sum(), np.finfo(float).tiny)


def write_csv(test, file):
    names = list(test.columns)
    with open(file + ".part", "w", encoding="utf-8", newline="\n") as stream:
        stream.write(",".join(names) + "\n")
        for row in zip(*(test.columns[name] for name in names)):
            stream.write(",".join(f"{value:.{DIGITS}g}" for value in row) + "\n")
    os.replace(file + ".part", file)


def write_hdf5(tests, file, length):
    """GrainLearning's layout: a group for each pressure, that at which the last stage of a test began, in it one for each path, with inputs (tests, length,
    strains), outputs (tests, length, what they led to) and contact_params (tests, parameters); names of the last axes are attributes of the file. Pressures in
    outputs are in millions of their unit. All sequences have the same length: they are interpolated at equal steps in time."""
    import h5py
    outputs = {"e": ("void_ratio", 1.0), "p": ("p", 1e-6), "q": ("q", 1e-6), "f0": ("fn_mean", 1.0), "a_c": ("a_c", 1.0), "a_n": ("a_n", 1.0), "a_t": ("a_t", 1.0)}
    parameters = sorted({word for test in tests for word in test.parameters})
    groups = {}
    for test in tests:
        stage = test.columns["path_stage"]
        pressure = test.columns["p"][max(np.argmax(stage == stage.max()) - 1, 0)]
        groups.setdefault((f"{pressure:.2g}", test.path), []).append(test)
    with h5py.File(file + ".part", "w") as data:
        data.attrs["outputs"] = list(outputs)
        data.attrs["contact_params"] = parameters
        data.attrs["made_by"] = "GPU_RVE, examples/element_tests/element_test.py"
        for (pressure, path), group in groups.items():
            inputs = [name for name in group[0].columns if name.startswith("e_")]
            data.attrs["inputs_" + path] = inputs

            def sequences(names, factors):
                sampled = []
                for test in group:
                    time = test.columns["time"]
                    at = np.linspace(time[0], time[-1], length)
                    sampled.append(np.stack([factor * np.interp(at, time, test.columns[name]) for name, factor in zip(names, factors)], axis=1))
                return np.array(sampled)
            place = data.create_group(f"{pressure}/{path}")
            place["inputs"] = sequences(inputs, np.ones(len(inputs)))
            place["outputs"] = sequences(*zip(*outputs.values()))
            place["contact_params"] = np.array([[test.parameters.get(word, np.nan) for word in parameters] for test in group])
            place.attrs["names"] = [test.name for test in group]
    os.replace(file + ".part", file)


def draw(tests, file):
    """q and volumetric strain over axial strain, q over p, void ratio over p."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(2, 2, figsize=(10, 8))
    panels = [("axial", 100, "axial strain [%]", "q", 1e-3, "q [kPa]"), ("p", 1e-3, "p [kPa]", "q", 1e-3, "q [kPa]"),
              ("axial", 100, "axial strain [%]", "volumetric", 100, "volumetric strain [%]"), ("p", 1e-3, "p [kPa]", "void_ratio", 1, "void ratio e")]
    for axis, (x, x_factor, x_label, y, y_factor, y_label) in zip(axes.flat, panels):
        for k, test in enumerate(tests):
            axis.plot(x_factor * test.columns[x], y_factor * test.columns[y], label=test.name, color=f"C{k % 10}", linestyle="-" if k < 10 else "--")
        axis.set(xlabel=x_label, ylabel=y_label)
        axis.grid(alpha=0.3)
    axes[1, 1].set_xscale("log")
    if len(tests) <= 20:
        axes[0, 0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(file, dpi=90)
    plt.close(figure)


def differences(test, file, tolerance):
    """What differs from the baseline by more than a share of the largest value of its column."""
    if not os.path.exists(file):
        return [f"there is no baseline {file} (--update makes it)"]
    with open(file, encoding="utf-8") as stream:
        names = stream.readline().strip().split(",")
        known = np.loadtxt(stream, delimiter=",", ndmin=2)
    if names != list(test.columns) or len(known) != len(test.columns["time"]):
        return [f"{len(test.columns['time'])} rows of {len(test.columns)} columns, the baseline has {len(known)} of {len(names)}"]
    found = []
    for k, name in enumerate(names):
        error = np.abs(test.columns[name] - known[:, k]).max()
        largest = np.abs(known[:, k]).max()
        if error > tolerance * largest:
            found.append(f"{name} differs by {error:.3g}, the largest value is {largest:.3g}")
    return found


def new_parser():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", help="CSV file with the columns name, path, packing, and parameters of the material")
    parser.add_argument("--paths", help="file of loading paths (default: the table's name with .paths)")
    parser.add_argument("--out", help="folder to write into (default: the table's name with .out)")
    parser.add_argument("--baseline", help="folder to compare with (default: the table's name with .baseline)")
    parser.add_argument("--update", action="store_true", help="write the baseline instead of comparing with it")
    parser.add_argument("--tolerance", type=float, default=1e-5, help="largest difference over the largest value of a column (default: 1e-5, the digits of the "
                        "files, since the bits are the same on every machine)")
    parser.add_argument("--length", type=int, default=200, help="length of the sequences of tests.h5 (default: 200)")
    parser.add_argument("--without", action="append", default=[], choices=["hdf5", "picture"], help="do not write this")
    add_run_options(parser)
    return parser


def add_run_options(parser):
    parser.add_argument("--lmp", help="LAMMPS executable with the package (default: the newest of build/*/bin/lmp, or lmp on the PATH)")
    parser.add_argument("--units", default="si", help="units of LAMMPS (default: si)")
    parser.add_argument("--step", type=float, default=2e-4, help="LAMMPS time step, after which events of paths are looked at (default: 2e-4)")
    parser.add_argument("--dt", default="auto 0.9", help="DEM time step (default: auto 0.9: 0.9 of the stability bound, the least of a batch)")
    parser.add_argument("--format", default="mixed", choices=["fast", "mixed", "double"])
    parser.add_argument("--device", default="auto", choices=["auto", "cpu", "cuda"])
    parser.add_argument("--every", type=int, default=5, help="steps between rows (default: 5)")
    parser.add_argument("--most", type=int, default=100000, help="steps after which a test that has not ended is given up (default: 100000)")


def main():
    options = new_parser().parse_args()
    stem = os.path.splitext(os.path.abspath(options.table))[0]
    paths = os.path.abspath(options.paths or stem + ".paths")
    out = os.path.abspath(options.out or stem + ".out")
    baseline = os.path.abspath(options.baseline or stem + ".baseline")
    try:
        for kind, module in (("hdf5", "h5py"), ("picture", "matplotlib")):
            if kind not in options.without:
                try:
                    __import__(module)
                except ImportError:
                    raise Failure(f"there is no module {module}: install it (Debian: python3-{module}), or say --without {kind}") from None
        tests = read_table(options.table)
        run(tests, os.path.dirname(stem), paths, out, options)
    except (Failure, OSError) as problem:
        print(f"element_test: {problem}")
        sys.exit(2)
    for test in tests:
        write_csv(test, os.path.join(out, test.name + ".csv"))
    if "hdf5" not in options.without:
        write_hdf5(tests, os.path.join(out, "tests.h5"), options.length)
    if "picture" not in options.without:
        draw(tests, os.path.join(out, "curves.png"))
    failed = 0
    for test in tests:
        file = os.path.join(baseline, test.name + ".csv")
        said = [test.problem] if test.problem else []
        if options.update and not said:
            os.makedirs(baseline, exist_ok=True)
            write_csv(test, file)
        elif not options.update:
            said += differences(test, file, options.tolerance)
        last = {name: column[-1] for name, column in test.columns.items()}
        print(f"{test.name}: {len(test.columns['time'])} rows, at the end p {last['p']:.4g} q {last['q']:.4g} e {last['void_ratio']:.4f}, energy error "
              f"{energy_error(test):.1e}" + "".join(f"\n    {what}" for what in said))
        failed += bool(said)
    print(f"{len(tests)} tests, {failed} that failed or differ; {out}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
