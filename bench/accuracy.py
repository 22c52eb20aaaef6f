#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Measures errors and costs of the settings of fix rve, and draws the Pareto plot.

    python3 bench/accuracy.py --bin build/host/bin --out bench/results/accuracy-cpu.json
    python3 bench/accuracy.py --bin build/cuda/bin --out bench/results/accuracy-H200.json \
        --device cuda --copies 49
    python3 bench/accuracy.py --bin build/cuda/bin --device cuda --copies 1200 --presets \
        --out bench/results/accuracy-presets-H200.json
    python3 bench/accuracy.py --shape sphere --bin build/host/bin \
        --out bench/results/accuracy-spheres-cpu.json
    python3 bench/accuracy.py --shape sphere --floor --bin build/host/bin \
        --out bench/results/floor-spheres-cpu.json
    python3 bench/accuracy.py --plot bench/results/accuracy-cpu.json

1. Eight packings of disks or spheres are made from eight seeds. Errors are ranges over them, since
   a verdict for one seed need not hold for another.
2. On a CPU the engine is compared with plain LAMMPS (examples/crosscheck, which needs numpy); if
   that fails, nothing else runs. On a GPU bench_accuracy requires the bits of the CPU instead. Unit
   tests compare the forces of spheres with those of LAMMPS.
3. bench_accuracy compares its reference with closed forms and runs the settings in six element
   tests. It fails if it does not detect a planted defect.
4. The footing of bench/in.footing_accuracy, with disks, runs with some settings and all seeds. The
   step fails if it does not detect a mass that is far too large.
5. On a CPU packings of 100 to 800 grains are compared in mean and scatter; the rows go to
   grains-... next to the output.

--floor only holds packings of three stiffnesses at rest in each number format, for the unbalanced
force that remains.
--presets only makes the packings and compares the costs of the three presets in the element tests.
--skipping does the same for adaptive substeps with and without quiescent.

--plot draws doc/src/figures/accuracy_pareto-... . It needs numpy and matplotlib (Debian:
python3-numpy, python3-matplotlib).
"""

import argparse
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
import bench_records

REPOSITORY = pathlib.Path(__file__).resolve().parent.parent
SEEDS = (1, 2, 3, 4, 5, 6, 7, 8)
GRAINS = (100, 200, 400, 800)
LIMIT = 0.01     # error before bifurcation, as in bench_accuracy
PARTED = 0.002    # deviation of twins at which curves count as parted, as in bench_accuracy

# The material has an overlap of half a per cent at 1e5 Pa for both shapes.
MATERIAL = {
    "disk": "radius uniform 0.0025 0.005 friction 0.5 density 2650 damping 0.3 thickness 0.075",
    "sphere": "shape sphere radius uniform 0.0025 0.005 friction 0.5 density 2650 damping 0.3"
}
STIFFNESS = {"disk": 1e6, "sphere": 1.5e5}
SIZE = {"disk": 400, "sphere": 200}    # grains of a packing

# Twins have different steps; curves are compared as long as all twins agree.
TWINS = tuple((f"twin {fraction}", "twin", f"preset reference dt auto {fraction}")
              for fraction in (0.2, 0.19, 0.21, 0.18, 0.22))

# setting, knob, keywords of fix rve
FOOTING = (
    ("small-step reference", "reference", "preset reference dt auto 0.05"),
    ("draft", "preset", "preset draft"),
    ("standard", "preset", "preset standard"),
    ("reference", "preset", "preset reference"),
    ("fast", "format", "format fast"),
    ("double", "format", "format double"),
    ("dt 0.2", "dt", "dt auto 0.2"),
    ("mass_scaling 4", "mass_scaling", "mass_scaling 4"),
    ("adaptive 1e-5 1e-3", "substeps", "substeps adaptive 1e-5 1e-3"),
    ("quiescent 1e-5", "quiescent", "substeps adaptive 1e-5 1e-3 quiescent 1e-5"),
    ("regression 5 2", "stress", "stress regression 5 2"),
    # The styles have no defect to plant, so this mass must be detected.
    ("mass_scaling 10000", "defect", "mass_scaling 10000"),
)


# Settings that exist on one device only.
FOOTING_ON = {
    "cpu": (("single", "format", "format single"), ),
    "cuda": (("fast, relaxed", "arithmetic", "format fast arithmetic relaxed"),
             ("mixed, relaxed", "arithmetic", "arithmetic relaxed"))
}


def run(command, folder, **more):
    """Runs the command and returns the share of a CPU that it had."""
    def of_children():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    start, before = time.monotonic(), of_children()
    environment = dict(os.environ,
                       OMPI_ALLOW_RUN_AS_ROOT="1",
                       OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMPI_MCA_ess_singleton_isolated="1",
                       **more)
    if subprocess.run([str(word) for word in command], cwd=folder, env=environment).returncode:
        sys.exit(f"failed: {' '.join(map(str, command))}")
    return min(1.0, (of_children() - before) / (time.monotonic() - start))


def make_packings(lmp, folder, shape, grains, seeds=SEEDS, times_as_stiff=1):
    files = [f"{shape}s_{grains}_{times_as_stiff}_{seed}.rve" for seed in seeds]
    stiffness = times_as_stiff * STIFFNESS[shape]
    script = "units si\n" + "".join(
        f"create_rve {name} grains {grains} seed {seed} {MATERIAL[shape]} kn {stiffness} kt "
        f"{stiffness} pressure 1e5\n"
        for name, seed in zip(files, seeds))
    (folder / "in.packings").write_text(script)
    run([lmp, "-in", "in.packings", "-screen", "none", "-log", "log.packings"], folder)
    return files


def read_curve(path):
    """Returns the pressure over the settlement, the seconds of the RVEs, and the DEM steps of one
    RVE."""
    rows = [[float(word) for word in line.split()] for line in path.read_text().splitlines()
            if not line.startswith("#")]
    return [row[1] for row in rows], rows[-1][2], rows[-1][3]


def mean(values):
    return sum(values) / len(values)


def range_of(errors):
    """Returns statistics of the errors of all seeds, as bench_accuracy computes them."""
    beyond = sum(error > LIMIT for error in errors)
    verdict = "within" if beyond == 0 else "beyond the limit" if beyond == len(
        errors) else "beyond for some seeds"
    return {
        "verdict": verdict, "limit": LIMIT, "least": min(errors),
        "median": statistics.median(errors), "seeds": len(errors), "seeds_beyond": beyond
    }


def footing(lmp, folder, device):
    """Returns rows of the footing: errors of the pressure under the plate over the settlement.

    The seeds run one after the other, so that other load on the machine affects all settings alike.
    On a CPU the wall time of the RVEs is multiplied by the share of the CPU that the process had.
    """
    settings = FOOTING + FOOTING_ON[device]
    curves, seconds, steps = {}, {}, {}
    for seed in SEEDS:
        for name, _, keywords in settings + TWINS:
            out = f"{name.replace(' ', '_').replace(',', '')}.{seed}"
            share = run([
                lmp, "-in", REPOSITORY / "bench" / "in.footing_accuracy", "-var", "packing",
                f"small_{seed}.rve", "-var", "seed", seed, "-var", "keywords",
                f"{keywords} device {device} threads 1", "-var", "out", out, "-screen", "none",
                "-log", f"log.{out}"
            ], folder)
            curves[name, seed], wall, steps[name, seed] = read_curve(folder / f"curve.{out}")
            seconds[name, seed] = wall * share if device == "cpu" else wall
    reference = FOOTING[0][0]
    ends = {}
    for seed in SEEDS:
        first = curves[TWINS[0][0], seed]
        allowed = PARTED * max(first)
        ends[seed] = next((k for k, value in enumerate(first) if any(
            abs(curves[name, seed][k] - value) > allowed for name, *_ in TWINS[1:])), len(first))
    last = [mean(curves[reference, seed][-20:]) for seed in SEEDS]
    rows = []
    for name, knob, keywords in settings[1:]:
        errors, after = [], []
        for seed in SEEDS:
            exact, curve, end = curves[reference, seed], curves[name, seed], ends[seed]
            errors.append(
                max([0.0] + [abs(a - b) / max(exact) for a, b in zip(curve[:end], exact[:end])]))
            if end < len(exact):
                after.append(mean(curve[end:]) / mean(exact[end:]) - 1.0)
        details = {
            **range_of(errors), "keywords": keywords,
            "mean_pressure_afterwards": mean(after) if after else 0.0,
            "scatter_of_pressure": statistics.stdev(last) / len(SEEDS)**0.5 / mean(last),
            "share_before_bifurcation": sum(ends.values()) /
            sum(len(curves[reference, seed]) for seed in SEEDS), "dem_steps": mean(
                [steps[name, seed] for seed in SEEDS]), "cost_over_reference": statistics.median(
                    seconds[name, seed] / seconds[reference, seed] for seed in SEEDS)
        }
        if knob == "defect":
            details["cost_over_reference"] = 0.0
        rows.append({
            "case": {
                "device": "cuda" if device == "cuda" else "cpu-1", "code": "gpu_rve",
                "scene": "footing_small", "dim": 2, "grains": 100, "rves": 48, "setting": name,
                "knob": knob
            }, "metric": "stress_error_rel", "value": max(errors), "unit": "-", "details": details
        })
        print(
            f"footing     {name:28s} error {min(errors):.1e} to {max(errors):.1e}  afterwards "
            f"{details['mean_pressure_afterwards']:+.1e}  before "
            f"{details['share_before_bifurcation']:.2f}  cost {details['cost_over_reference']:.3f} "
            "of the reference",
            flush=True)
    unseen = [
        row["case"]["setting"] for row in rows
        if row["case"]["knob"] == "defect" and row["value"] <= LIMIT
    ]
    if unseen:
        sys.exit(f"the planted defect goes unseen in the footing: {', '.join(unseen)}")
    return rows


def presets(rows):
    """Returns the largest error of each preset over the scenes, and its cost relative to the preset
    reference."""
    of = {}
    for row in rows:
        if row["case"].get("knob") == "preset":
            of.setdefault(row["case"]["setting"], {})[row["case"]["scene"]] = row
    summary = []
    for name, scenes in of.items():
        dim = next(iter(scenes.values()))["case"]["dim"]
        ratios = {
            scene: of["reference"][scene]["details"]["cost_over_reference"] /
            row["details"]["cost_over_reference"]
            for scene, row in scenes.items()
        }
        fewer = [
            of["reference"][scene]["details"]["dem_steps"] / row["details"]["dem_steps"]
            for scene, row in scenes.items()
        ]
        slowest, fastest = min(ratios, key=ratios.get), max(ratios, key=ratios.get)
        worst = max(scenes.values(), key=lambda row: row["value"])
        summary.append({
            "case": {"preset": name, "dim": dim}, "metric": "largest_stress_error_rel",
            "value": worst["value"], "unit": "-", "details": {
                "in_scene": worst["case"]["scene"], **{
                    key: worst["details"].get(key, "")
                    for key in ("verdict", "least", "median", "seeds", "seeds_beyond")
                }, "least_speedup": ratios[slowest], "least_in_scene": slowest,
                "largest_speedup": ratios[fastest], "largest_in_scene": fastest,
                "least_ratio_of_steps": min(fewer)
            }
        })
        print(
            f"preset {name}: error at most {worst['value']:.2e} ({worst['case']['scene']}), "
            f"{ratios[slowest]:.1f} ({slowest}) to "
            f"{ratios[fastest]:.1f} ({fastest}) times cheaper than reference")
    return summary


def in_repository(path):
    """Returns the path relative to the repository, or its name if it is outside."""
    return path.relative_to(REPOSITORY) if path.is_relative_to(REPOSITORY) else path.name


def command_of(options, binaries, out):
    return (
        f"python3 bench/accuracy.py --bin {in_repository(binaries)} --out {in_repository(out)} "
        f"--device {options.device} "
        f"--copies {options.copies}" + (" --shape sphere" if options.shape == "sphere" else "") +
        (f" --grains {options.grains}" if options.grains else "") +
        (f" --scenes {options.scenes}" if options.scenes else "") +
        (" --floor" if options.floor else "") + (" --presets" if options.presets else "") +
        (" --skipping" if options.skipping else "") +
        (" --no-footing" if options.no_footing else ""))


def compare_numbers_of_grains(options, binaries, folder, out, machine):
    # Small packings cost less, so there are more of them.
    many = [
        name for grains in GRAINS
        for name in make_packings(binaries / "lmp", folder, options.shape, grains,
                                  range(1, 3200 // grains + 1))
    ]
    run([
        binaries / "bench_accuracy",
        out.with_name(out.stem.replace("accuracy", "grains") + ".json"), *many, "--ensemble",
        "--device", options.device, *machine
    ], folder)


def measure(options):
    folder = pathlib.Path(options.dir).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    binaries, out = pathlib.Path(options.bin).resolve(), pathlib.Path(options.out).resolve()
    machine = ["--machine", options.machine] if options.machine else []
    if options.only_grains:
        return compare_numbers_of_grains(options, binaries, folder, out, machine)
    grains = options.grains or SIZE[options.shape]
    if options.floor:
        many = [
            name for factor in (1, 10, 100)
            for name in make_packings(binaries /
                                      "lmp", folder, options.shape, grains, SEEDS[:4], factor)
        ]
        run([
            binaries / "bench_accuracy", out, *many, "--floor", "--device", options.device, *machine
        ], folder)
        return bench_records.write(
            {**bench_records.read(out), "command": command_of(options, binaries, out)}, out)
    packings = make_packings(binaries / "lmp", folder, options.shape, grains)
    only = ["--presets"] if options.presets else ["--skipping"] if options.skipping else []
    if options.device == "cpu" and options.shape == "disk" and not only:
        run([
            sys.executable, REPOSITORY / "examples" / "crosscheck" / "crosscheck.py", "--short",
            "--lmp", binaries / "lmp", "--dir", folder / "crosscheck"
        ], folder)
    scenes = ["--scenes", options.scenes] if options.scenes else []
    run([
        binaries / "bench_accuracy", out, *packings, "--device", options.device, "--copies",
        options.copies, *scenes, *only, *machine
    ], folder)
    report = bench_records.read(out)
    report["command"] = command_of(options, binaries, out)
    if only:
        return bench_records.write(report, out)
    swept = report["rows"]
    report["rows"] = swept + presets(swept)
    bench_records.write(report, out)    # partial results, in case the rest is stopped
    if options.shape == "disk" and not options.no_footing:
        swept = swept + footing(binaries / "lmp", folder, options.device)
        report["rows"] = swept + presets(swept)
        bench_records.write(report, out)
    if options.device == "cpu" and not options.scenes:
        compare_numbers_of_grains(options, binaries, folder, out, machine)


def plot(options):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

    report = bench_records.read(options.plot)
    scenes = {}
    for row in report["rows"]:
        case = row["case"]
        if row["metric"] == "stress_error_rel" and "knob" in case and case["knob"] not in (
                "reference", "defect", "feature") and row["value"] > 0.0:
            scenes.setdefault(case["scene"], []).append(
                (row["details"]["cost_over_reference"], row["value"], case["knob"], case["setting"],
                 row["details"].get("least", row["value"])))
    knobs = sorted({point[2] for points in scenes.values() for point in points})
    styles = {knob: (marker, f"C{k}") for k, (knob, marker) in enumerate(zip(knobs, "osv^D<>PX*"))}
    columns = min(4, len(scenes) + 1)    # the last one is for the legend
    rows = -(-(len(scenes) + 1) // columns)
    figure, all_axes = plt.subplots(rows,
                                    columns,
                                    figsize=(3.25 * columns, 3.2 * rows),
                                    squeeze=False,
                                    constrained_layout=True)
    for axes in all_axes.flat[len(scenes):]:
        axes.axis("off")
    for axes, (scene, points) in zip(all_axes.flat, scenes.items()):
        for knob in knobs:
            some = np.array(
                [(point[0], point[1], point[4]) for point in points if point[2] == knob])
            if len(some):
                axes.plot(some[:, 0],
                          some[:, 1],
                          styles[knob][0],
                          color=styles[knob][1],
                          markersize=5,
                          label=knob)
                axes.vlines(some[:, 0],
                            np.maximum(some[:, 2], 1e-3 * some[:, 1]),
                            some[:, 1],
                            color=styles[knob][1],
                            linewidth=0.8)
        front, best = [], np.inf
        for cost, error, *_ in sorted(points):
            if error < best:
                front.append((cost, error))
                best = error
        axes.step(*np.array(front).T, where="post", color="gray", linewidth=1.0, zorder=0)
        for cost, error, knob, setting, _ in points:
            if knob == "preset":
                axes.annotate(setting, (cost, error),
                              textcoords="offset points",
                              xytext=(4, 4),
                              fontsize=8)
        axes.axhline(LIMIT, color="black", linewidth=0.6, linestyle=":")
        axes.set_xscale("log")
        axes.set_yscale("log")
        low, high = min(point[0] for point in points), max(point[0] for point in points)
        axes.xaxis.set_minor_formatter(NullFormatter())
        if high < 50.0 * low:    # the range has at most one power of ten
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.set_title(scene, fontsize=10)
        axes.grid(True, which="major", alpha=0.3)
    for axes in all_axes[-1]:
        axes.set_xlabel("cost / small-step reference")
    for axes in all_axes[:, 0]:
        axes.set_ylabel("largest stress error before bifurcation" if rows >
                        1 else "stress error before bifurcation")
    handles, labels = all_axes.flat[0].get_legend_handles_labels()
    all_axes.flat[-1].legend(handles,
                             labels,
                             loc="center",
                             fontsize=9,
                             title=report.get("machine", ""))
    figure.savefig(
        REPOSITORY / "doc" / "src" / "figures" /
        (pathlib.Path(options.plot).stem.replace("accuracy", "accuracy_pareto") + ".png"),
        dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default="build/host/bin", help="folder of lmp and bench_accuracy")
    parser.add_argument("--dir", default="build/accuracy", help="folder where the runs write")
    parser.add_argument("--out", default="bench/results/accuracy-cpu.json")
    parser.add_argument("--device", default="cpu", choices=("cpu", "cuda"))
    parser.add_argument(
        "--copies",
        type=int,
        default=1,
        help="of each packing: they fill a GPU, so that costs are those of throughput")
    parser.add_argument("--shape", default="disk", choices=("disk", "sphere"))
    parser.add_argument("--grains", type=int, help="of a packing (default: 400 disks, 200 spheres)")
    parser.add_argument("--machine", help="words for the machine (default: the engine's)")
    parser.add_argument(
        "--scenes",
        metavar="A,B",
        help="these element tests only; a planted defect that only others find is then no failure")
    parser.add_argument("--presets",
                        action="store_true",
                        help="what the presets cost beside each other, and nothing else")
    parser.add_argument(
        "--skipping",
        action="store_true",
        help="what adaptive substeps cost with and without quiescent, and nothing else")
    parser.add_argument("--floor",
                        action="store_true",
                        help="the unbalanced force of packings at rest, and nothing else")
    parser.add_argument("--no-footing", action="store_true")
    parser.add_argument("--only-grains",
                        action="store_true",
                        help="compare numbers of grains, and nothing else")
    parser.add_argument("--plot", metavar="FILE.json", help="draw this file instead of measuring")
    options = parser.parse_args()
    plot(options) if options.plot else measure(options)


if __name__ == "__main__":
    main()
