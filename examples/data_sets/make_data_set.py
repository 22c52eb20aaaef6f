#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""A data set for surrogates of grains: RVEs on random strain paths with reversals, many in one batch, as an HDF5 file.

    python3 make_data_set.py --paths 100 --out paths.h5

Each path is a chain of straight pieces in the space of strains. A piece has a random length and a random direction, or turns back along the piece before it. The RVE of
a path follows it slowly, and after each of its samples deformation, stress, void ratio, fabric and energies are written down. Path number k is a function of the seed
and of k: it does not depend on how many paths there are, on the batches, the threads or the device, to the bit.

The manual has a page on what is in the file. Needs gpu_rve, numpy and h5py (Debian: python3-h5py).
"""

import argparse
import glob
import hashlib
import json
import math
import os
import subprocess
import sys
import time

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
REPOSITORY = os.path.dirname(os.path.dirname(HERE))
AXES = "xyz"
SCALARS = ["void_ratio", "coordination", "sliding", "unbalanced", "kinetic", "elastic", "work", "loss_friction", "loss_damping", "loss_viscous"]
OF_CONTACTS = ["branch_fabric", "fn_fabric", "ft_fabric"]    # with --contacts
# Samples between two looks at the stable time step, which cost as much as a hundred DEM steps. With half of the bound a packing may become four times as stiff in between.
SAMPLES_OF_STEP = 20


def import_gpu_rve():
    """An installed package, or that of this tree with the newest library that was built."""
    built = glob.glob(os.path.join(REPOSITORY, "build", "*", "lib", "librve.so"))
    if built:
        os.environ.setdefault("GPU_RVE_LIBRARY", max(built, key=os.path.getmtime))
    sys.path.append(os.path.join(REPOSITORY, "python"))
    import gpu_rve
    return gpu_rve


def symmetric(dimension):
    """Names of the components of a symmetric tensor: xx yy xy, or xx yy zz xy xz yz."""
    axes = AXES[:dimension]
    return [a + a for a in axes] + [a + b for k, a in enumerate(axes) for b in axes[k + 1:]]


def size(tensor):
    return np.sqrt(np.einsum("...ab,...ab", tensor, tensor))


def sum_of_squares(tensor):
    """Of the components of a list, row by row: in the order in which numpy's einsum has added them on all paths so far, so that paths keep their bits."""
    f = [x * x for x in tensor]
    if len(f) == 4:
        return (f[0] + f[2]) + (f[1] + f[3])
    return ((f[0] + (f[2] + (f[4] + f[6]))) + f[8]) + (f[1] + (f[3] + (f[5] + f[7])))


class Path:
    """Random strains, by the numbers of a path alone: straight pieces with `directions` (pieces, D, D), symmetric and of size 1, for so many samples, `counts`. `steps` are the
    strains from one sample of a piece to the next."""

    def __init__(self, seed, number, dimension, options):
        self.random = np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy=seed, spawn_key=(number,))))
        self.dimension, self.options = dimension, options
        self.share = self.random.uniform(size=len(options.vary))    # of the ranges of parameters
        # Lists and floats: a tensor is too small for numpy to be quick with it.
        strain, direction, missing = [0.0] * dimension**2, None, options.samples
        directions, self.counts, self.reversals = [], [], 0
        while missing:
            direction, turned, samples = self.next_piece(strain, direction)
            self.reversals += turned
            samples = min(samples, missing)
            missing -= samples
            for k, x in enumerate(direction):
                step, total = options.strain * x, strain[k]
                for _ in range(samples):    # as the strain of a material adds up
                    total += step
                strain[k] = total
            directions.append(direction)
            self.counts.append(samples)
        self.directions = np.array(directions).reshape(-1, dimension, dimension)
        self.steps = options.strain * self.directions

    @property
    def rates(self):
        """Strains from sample to sample (samples, D, D)."""
        return np.repeat(self.steps, self.counts, axis=0)

    def next_piece(self, strain, before):
        """Direction of size 1, whether it is a reversal, and number of samples. Strains stay within their limits: a piece that would leave them is drawn again."""
        options, n = self.options, self.dimension
        while True:
            samples = max(1, round(self.random.exponential(options.piece / options.strain)))
            length = options.strain * samples
            turned = before is not None and self.random.uniform() < options.reversals
            if turned:
                direction = [-x for x in before]
            else:
                drawn = self.random.normal(size=(n, n)).ravel().tolist()
                drawn = [0.5 * (drawn[n * a + b] + drawn[n * b + a]) for a in range(n) for b in range(n)]
                deviator = deviator_of(drawn, n)
                norm, part = math.sqrt(sum_of_squares(deviator)), options.volumetric * self.random.normal() / math.sqrt(n)
                direction = [x / norm for x in deviator]
                for k in range(0, n * n, n + 1):
                    direction[k] += part
                norm = math.sqrt(sum_of_squares(direction))
                direction = [x / norm for x in direction]
            end = [x + length * y for x, y in zip(strain, direction)]
            if abs(sum(end[::n + 1])) <= options.most_volume and math.sqrt(sum_of_squares(deviator_of(end, n))) <= options.most_shear:
                return direction, turned, samples


def deviator_of(tensor, n):
    """Of n x n components, row by row."""
    mean, deviator = sum(tensor[::n + 1]) / n, list(tensor)
    for k in range(0, n * n, n + 1):
        deviator[k] -= mean
    return deviator


def exponential(strain):
    """exp of symmetric matrices (n, D, D)."""
    values, vectors = np.linalg.eigh(strain)
    return np.einsum("nab,nb,ncb->nac", vectors, np.exp(values), vectors)


def components(batch, name):
    """A tensor with all its components (n, D, D)."""
    axes = AXES[:batch.dimension]
    return np.stack([batch[f"{name}{a}{b}"] for a in axes for b in axes], axis=1).reshape(-1, batch.dimension, batch.dimension)


def look(batch, contacts):
    """What there is of each RVE, but for its stress, which a call that moves it answers."""
    data = {name: batch[name] for name in SCALARS + (["branch_mean", "fn_mean"] if contacts else [])}
    for tensor in ["fabric"] + (OF_CONTACTS if contacts else []):
        data[tensor] = np.stack([batch[f"{tensor}_{ab}"] for ab in symmetric(batch.dimension)], axis=1)
    data["deformation_gradient"] = components(batch, "def_")
    return data


class Increments:
    """Of many paths, sample by sample. A piece has one increment however many samples it has."""

    def __init__(self, paths):
        steps = np.concatenate([path.steps for path in paths])
        self.of_piece, self.size_of_piece = exponential(steps), size(steps)
        pieces = np.split(np.arange(len(steps)), np.cumsum([len(path.counts) for path in paths])[:-1])
        self.piece = np.array([np.repeat(own, path.counts) for own, path in zip(pieces, paths)], dtype=np.int32).T.copy()    # (samples, paths)

    def of_sample(self, sample):
        """Of the deformation gradients (paths, D, D), and sizes of the strains (paths)."""
        piece = self.piece[sample]
        return self.of_piece[piece], self.size_of_piece[piece]


class Grains:
    """What of its packing limits the rate of an RVE; it does not change on the way."""

    def __init__(self, batch, packings, diameter):
        self.diameter = diameter
        self.density = np.array([packing["density"] for packing in packings])
        if batch.dimension == 2:
            self.density = self.density * np.array([packing["mass_depth"] / packing["thickness"] for packing in packings])

    def slow_steps(self, pressure, strain, dt, options):
        """How many DEM steps of dt keep the inertial number of the strain below its limit: I = |D| d sqrt(rho/p)."""
        p = np.maximum(pressure, options.least_pressure)
        most_rate = options.inertia / (self.diameter * np.sqrt(self.density / p))
        return np.maximum(1, np.ceil(strain / (most_rate * dt))).astype(np.int32)


class Progress:
    """Says where a data set is, at once and then every ten seconds, also into a log."""

    EVERY = 10.0    # [s]

    def __init__(self, options):
        self.options, self.begin, self.paths = options, time.perf_counter(), 0
        self.said = self.begin - self.EVERY

    def seconds(self):
        return time.perf_counter() - self.begin

    def say(self, line):
        self.said = time.perf_counter()
        print(line, flush=True)

    def begin_batch(self, n):
        self.of_batch = n
        self.say(f"{n} of {self.options.paths} paths begin")

    def end_sample(self, sample):
        if time.perf_counter() - self.said >= self.EVERY:
            self.say(f"sample {sample} of {self.options.samples} of {self.of_batch} paths, {self.to_go(self.paths + self.of_batch * sample / self.options.samples)}")

    def end_batch(self):
        self.paths += self.of_batch
        self.say(f"{self.paths} of {self.options.paths} paths, {self.to_go(self.paths)}")

    def to_go(self, done):
        return f"{self.seconds():.0f} s, {self.seconds() / done * (self.options.paths - done):.0f} s to go"


def run_batch(gpu_rve, originals, paths, options, progress):
    """Data (paths, samples + 1, ...), sound samples of each path, status of each, and the DEM steps of all."""
    n, packings = len(paths), []
    of_original = np.array([2.0 * np.mean(packing.radii) for packing in originals])
    for path, number in paths:
        packing = originals[number % len(originals)].copy()
        for (keyword, low, high), share in zip(options.vary, path.share):
            packing[keyword] = low + share * (high - low)
            if keyword == "kn" and "kt" not in [other for other, _, _ in options.vary]:
                packing["kt"] = packing["kn"]
        packings.append(packing)
    batch = gpu_rve.Batch(packings, format=options.format, device=options.device, threads=options.threads, energy=True)
    grains = Grains(batch, packings, of_original[[number % len(originals) for _, number in paths]])
    increments = Increments([path for path, _ in paths])
    data, sound, status, total = {}, np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.uint32), 0
    running = np.ones(n, dtype=bool)
    stress, pressure = components(batch, "s"), batch["p"]
    for sample in range(options.samples + 1):
        if sample:
            increment, strain = increments.of_sample(sample - 1)
            if sample % SAMPLES_OF_STEP == 1:
                dt = 0.5 * batch.time_steps()
            steps = grains.slow_steps(pressure, strain, dt, options)
            if running.all():    # without a list of them, which costs more than all quantities
                stress, status = batch.advance(increment, dt, steps)
                total += int(steps.sum())
                running = ~batch.failed(status)
            elif running.any():
                which = np.flatnonzero(running)
                stress[which], status[which] = batch.advance(increment[which], dt[which], steps[which], which)
                total += int(steps[which].sum())
                running[which] = ~batch.failed(status[which])
            else:
                break
            pressure = batch["p"]
        found = look(batch, options.contacts)
        found["stress"] = stress
        for name, values in found.items():
            rows = data.setdefault(name, np.full((n, options.samples + 1) + values.shape[1:], np.nan))
            rows[running, sample] = values[running]
        sound[running] = sample + 1
        if sample:
            progress.end_sample(sample)
    parameters = np.array([[packing[keyword] for keyword, _, _ in options.vary] for packing in packings]).reshape(n, -1)
    return data, sound, status, parameters, batch.description, total


def commit():
    """Of the repository that this script is in; "unknown" outside of one."""
    try:
        done = subprocess.run(["git", "-C", HERE, "describe", "--always", "--dirty", "--abbrev=40"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              universal_newlines=True, check=True)
        return done.stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def new_parser():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="paths.h5", help="file to write (default: paths.h5)")
    parser.add_argument("--paths", type=int, default=100, help="number of paths (default: 100)")
    parser.add_argument("--first", type=int, default=0, help="number of the first path (default: 0): parts of a data set that are made one after the other")
    parser.add_argument("--samples", type=int, default=200, help="samples of a path (default: 200)")
    parser.add_argument("--packing", nargs="+", default=[os.path.join(HERE, "..", "packings", "A_h0075.rve")],
                        help="packing files, which paths take in turn (default: 400 disks at 100 kPa)")
    parser.add_argument("--vary", nargs=3, action="append", default=[], metavar=("KEYWORD", "LOW", "HIGH"),
                        help="a parameter of the material, uniform in a range; kn takes kt along unless that varies, too")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--strain", type=float, default=2e-4, help="size of the strain from sample to sample (default: 2e-4)")
    parser.add_argument("--piece", type=float, default=5e-3, help="mean length of a straight piece (default: 5e-3)")
    parser.add_argument("--reversals", type=float, default=0.3, help="share of pieces that turn back (default: 0.3)")
    parser.add_argument("--volumetric", type=float, default=0.2, help="volumetric over deviatoric part of a direction, root mean square (default: 0.2)")
    parser.add_argument("--most_volume", type=float, default=0.005, help="largest volumetric strain, either way (default: 0.005)")
    parser.add_argument("--most_shear", type=float, default=0.03, help="largest size of the deviatoric strain (default: 0.03)")
    parser.add_argument("--inertia", type=float, default=1e-3, help="inertial number that the strain does not exceed (default: 1e-3)")
    parser.add_argument("--least_pressure", type=float, default=1e3, help="below it the inertial number is that at this pressure (default: 1e3)")
    parser.add_argument("--contacts", action="store_true", help="fabric of branches and forces, too: a millisecond of a core for each sample")
    parser.add_argument("--batch", type=int, default=4096, help="RVEs that are advanced together (default: 4096)")
    parser.add_argument("--chunk", type=int, default=64, help="paths of a chunk of the file (default: 64)")
    parser.add_argument("--format", default="mixed", choices=["fast", "mixed", "double"])
    parser.add_argument("--device", default="auto", choices=["auto", "cpu", "cuda"])
    parser.add_argument("--threads", type=int, default=0, help="CPU threads (default: 0, as OpenMP decides)")
    parser.add_argument("--digits", default="float32", choices=["float32", "float64"], help="numbers of the file (default: float32)")
    return parser


def check(options):
    """Ends the script with what is wrong."""
    for name, least in (("paths", 1), ("samples", 1), ("batch", 1), ("chunk", 1), ("first", 0), ("seed", 0), ("threads", 0)):
        if getattr(options, name) < least:
            sys.exit(f"make_data_set: --{name} is {getattr(options, name)}; it must be {least} or more")
    for name in ("strain", "piece", "most_volume", "most_shear", "inertia", "least_pressure"):
        if not 0.0 < getattr(options, name) < np.inf:
            sys.exit(f"make_data_set: --{name} is {getattr(options, name)}; it must be above 0")
    if not 0.0 <= options.reversals < 1.0:
        sys.exit(f"make_data_set: --reversals is {options.reversals}; it must be from 0 to below 1")
    if options.volumetric < 0.0:
        sys.exit(f"make_data_set: --volumetric is {options.volumetric}; it must be 0 or more")
    for name in ("most_volume", "most_shear"):
        if getattr(options, name) < 4.0 * options.strain:
            sys.exit(f"make_data_set: --{name} is {getattr(options, name)}; it must be at least four samples long, {4.0 * options.strain:g}: no path stays within less")
    try:
        options.vary = [(keyword, float(low), float(high)) for keyword, low, high in options.vary]
    except ValueError as problem:
        sys.exit(f"make_data_set: --vary: {problem}")


def main():
    options = new_parser().parse_args()
    words = sys.argv[1:]
    check(options)
    import h5py
    gpu_rve = import_gpu_rve()
    try:
        originals = [gpu_rve.Packing.read(file) for file in options.packing]
        for keyword, low, high in options.vary:
            for value in (low, high):    # refused here, and not after an hour
                originals[0].copy()[keyword] = value
    except gpu_rve.Error as problem:
        sys.exit(f"make_data_set: {problem}")
    dimension = originals[0].dimension
    if any(packing.dimension != dimension for packing in originals):
        sys.exit("make_data_set: the packings are of disks and of spheres; they must be of one kind")
    progress, steps, failed, reversals = Progress(options), 0, 0, 0
    part = options.out + ".part"
    with h5py.File(part, "w") as file:
        for first in range(0, options.paths, options.batch):
            numbers = range(options.first + first, options.first + min(first + options.batch, options.paths))
            progress.begin_batch(len(numbers))
            paths = [(Path(options.seed, number, dimension, options), number) for number in numbers]
            data, sound, status, parameters, description, steps_of_batch = run_batch(gpu_rve, originals, paths, options, progress)
            data.update(length=sound, status=status, number=np.array(numbers, dtype=np.int64), parameters=parameters,
                        reversals=np.array([path.reversals for path, _ in paths], dtype=np.int32),
                        packing=np.array([number % len(originals) for number in numbers], dtype=np.int32))
            for name, values in data.items():
                if name not in file:
                    kind = options.digits if values.dtype.kind == "f" else values.dtype
                    file.create_dataset(name, shape=(options.paths,) + values.shape[1:], dtype=kind, chunks=(min(options.chunk, options.paths),) + values.shape[1:]
                                        if values.size else None, compression="gzip" if values.size else None, shuffle=bool(values.size), fletcher32=bool(values.size))
                if values.size:
                    file[name][first:first + len(values)] = values
            steps += steps_of_batch
            failed += int((sound <= options.samples).sum())
            reversals += int(data["reversals"].sum())
            progress.end_batch()
        for name in file:
            if name.endswith("fabric"):
                file[name].attrs["components"] = symmetric(dimension)
        file["parameters"].attrs["keywords"] = [keyword for keyword, _, _ in options.vary]
        for name in ("stress", "deformation_gradient"):
            file[name].attrs["components"] = "rows, columns"
        for k, packing in enumerate(options.packing):
            with open(packing, encoding="utf-8") as stream:
                text = stream.read()
            file[f"packings/{k}"] = text
            file[f"packings/{k}"].attrs["sha256"] = hashlib.sha256(text.encode()).hexdigest()
            file[f"packings/{k}"].attrs["name"] = os.path.basename(packing)
        file.attrs.update(format="gpu_rve paths 1", made_by="GPU_RVE, examples/data_sets/make_data_set.py", release=gpu_rve.release(), commit=commit(), engine=description,
                          seed=options.seed, settings=json.dumps({**{key: value for key, value in vars(options).items() if key != "out"}, "packing": [os.path.basename(name) for name in options.packing]}),
                          command=" ".join(words), numpy=np.__version__, h5py=h5py.__version__)
    os.replace(part, options.out)
    seconds = progress.seconds()
    print(f"{options.out}: {options.paths} paths of {options.samples} samples, {reversals} reversals, {failed} paths that ended before, {os.path.getsize(options.out) / 1e6:.1f} MB; "
          f"{steps / 1e6:.2f} million DEM steps of an RVE in {seconds:.1f} s, {3600 * options.paths / seconds:.0f} paths an hour; {description}")


if __name__ == "__main__":
    main()
