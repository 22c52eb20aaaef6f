#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""One RVE in fix rve and the same grains in plain LAMMPS, pair_style granular: the same forces, motion and stress?

    python3 crosscheck.py                      everything, two minutes
    python3 crosscheck.py --short              a part of it, 20 seconds
    python3 crosscheck.py --figure FILE.png    everything, and a figure

Prints a table of deviations with their tolerances and reasons. Exit status 1 if one is too large, 2 if a run fails or there is no lmp. Runs
in.prepare, in.grains_in_lammps and in.grains_in_rve, in a temporary directory or in --dir. Needs numpy, and matplotlib for --figure.

Units of deviations: positions in mean overlaps d, velocities (and spins times mean radius) in d sqrt(k_n/m), contact forces in mean contact
forces, stresses in mean stresses. Deviations of grains are root mean squares over those with two contacts or more.
"""

import argparse
import math
import os
import subprocess
import sys
import tempfile

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "validation"))
import harness
PACKING = os.path.join(HERE, "..", "packings", "A_h0075.rve")

# as in the input scripts
DT = 5e-5    # [s]
STIFFNESS = 1e6    # k_n [N/m]
STEPS = (1, 10, 100, 1000)
RATES = (0.05, 0.005)    # [1/s]
CURVE_STRAIN, CURVE_POINTS = 0.02, 40

VISCOUS = {"gamma_n": 50, "gamma_t": 50}
CUNDALL = {"cundall": 0.3}
ROLLING = {"kr": 1e6, "mu_r": 0.02}

STATES = {"isotropic": "packing at 100 kPa", "moving": "packing sheared to 1 %", "oblique": "cell that leans by 0.3",
          "leaning": "cell that leans by 0.6"}
BOXES = {"late": "one step late", "in_time": "in time"}

# Rounding: a coordinate of 0.15 m is a double with a unit of 2.8e-17 m, and four of them and a shift make a branch; the mean overlap is
# 4e-5 m. So a contact force is right to a few 1e-12 of the mean, and a grain has about four.
ROUNDING = 2e-11
CELL_ROUNDING = 1e-12    # of fractions of the cell, 1000 increments with 1e-16 each, and of their inverse
# Nearby trajectories separate exponentially: what 1000 steps make of rounding where grains still collide. Measured: 1e-9 here, and
# 2e-8 to 4e-6 when the packing is sheared a little further.
GROWN_ROUNDING = 1e-4
# A grain that meets another a little later than in the other code has another velocity for a while. Measured after 1000 steps: up to 6
# times the bound without collisions here, 11 times in slightly different cells, and 50 times with rolling resistance, where one grain
# that bounces to and fro makes 1e-6 of 1e-9 from step 540 on.
COLLISIONS = 200
# A tenth of the rate: a deviation that is linear in it falls to a tenth. After 1000 steps collisions blur this.
LEAST_RATIO = {10: 8.0, 100: 8.0, 1000: 3.0}
RATIO_REASON = {"late": "linear in the rate gives 10; at least 8, after 1000 steps 3",
                "in_time": "L.c falls faster, as c falls too; at least 8; 1000 steps not judged"}
# Beyond 1 % of strain contacts are lost at other moments: so far apart are stresses [p] of other codes with the same equations, and of
# translated copies of this packing.
SCATTER = {"uniaxial": 3e-4, "shear": 1.5e-3}


# ---- reading and writing ------------------------------------------------------------------------------------------------------------


class Packing:
    """A packing file of fix rve."""

    def __init__(self, path):
        with open(path) as stream:
            self.lines = stream.read().split("\n")
        words = [line.split("#")[0].split() for line in self.lines]

        def find(keyword):
            return next(k for k, w in enumerate(words) if w[:1] == [keyword])

        self.cell = np.array(words[find("cell") + 1:find("cell") + 3], float)
        self.thickness = float(words[find("thickness")][1])
        self.first = find("grains") + 1
        count = int(words[find("grains")][1])
        rows = sorted((w for w in words[self.first:find("contacts")] if w), key=lambda w: int(w[0]))
        assert len(rows) == count
        self.places = [w[:4] for w in rows]    # id, radius and coordinates, as text: exact
        fraction = np.array([[int(w[2]) / 2**64, int(w[3]) / 2**64] for w in rows])
        self.position = fraction @ self.cell.T
        self.velocity = np.array([w[4:6] for w in rows], float)
        self.spin = np.array([w[6] for w in rows], float)
        contacts = [w for w in words[find("contacts") + 1:] if len(w) > 2]
        self.tangential = {pair(int(w[0]), int(w[1])): float(w[2]) for w in contacts}
        # the moment on the grain with the lower ID
        self.rolling = {pair(int(w[0]), int(w[1])): math.copysign(1.0, int(w[1]) - int(w[0])) * float(w[3]) for w in contacts if len(w) > 3}

    def write(self, path, velocity, spin):
        """The same grains with these velocities and without tangential forces, which a LAMMPS data file does not have either."""
        with open(path, "w") as stream:
            stream.write("\n".join(self.lines[:self.first]) + "\n")
            for place, v, w in zip(self.places, velocity.tolist(), spin.tolist()):
                stream.write(" ".join(place) + f" {v[0]!r} {v[1]!r} {w!r}\n")
            stream.write("contacts 0\nchecksum none\nend\n")


def pair(i, j):
    return (min(i, j), max(i, j))


def read_dump(path):
    """{step: array of the rows} of a LAMMPS text dump."""
    frames = {}
    with open(path) as stream:
        for line in stream:
            if line.startswith("ITEM: TIMESTEP"):
                step = int(next(stream))
            elif line.startswith("ITEM: NUMBER"):
                count = int(next(stream))
            elif line.startswith(("ITEM: ATOMS", "ITEM: ENTRIES")):
                frames[step] = np.array([next(stream).split() for _ in range(count)], float)
    return frames


def read_thermo(path):
    """{step: values} of the thermo output in a log."""
    rows, inside = {}, False
    with open(path) as stream:
        for line in stream:
            words = line.split()
            if words[:1] == ["Step"] or line.startswith("Loop time"):
                inside = words[:1] == ["Step"]
            elif inside and words and words[0].isdigit():
                rows[int(words[0])] = [float(word) for word in words[1:]]
    return rows


class Contacts:
    """Contacts as LAMMPS sees them: from the grain with the lower ID to the other."""

    def __init__(self, rows):
        self.pairs = [pair(int(row[0]), int(row[1])) for row in rows]
        side = np.where(rows[:, 0] < rows[:, 1], 1.0, -1.0)[:, None]
        self.normal_force = side * rows[:, 2:4]    # on the first
        self.tangential_force = side * rows[:, 4:6]
        self.branch = -side * rows[:, 6:8]    # to the second
        normal = self.branch / np.linalg.norm(self.branch, axis=1)[:, None]
        self.tangential = self.tangential_force[:, 1] * normal[:, 0] - self.tangential_force[:, 0] * normal[:, 1]
        # the pseudo-force is the same seen from both; its moment over the reduced radius, on the first
        self.rolling = rows[:, 8] * normal[:, 1] - rows[:, 9] * normal[:, 0]

    def love(self, volume):
        return (self.normal_force + self.tangential_force).T @ self.branch / volume

    def carrying(self, num_grains):
        """Which grains have two contacts or more; the others fly freely until they hit."""
        return np.bincount(np.array(self.pairs).ravel() - 1, minlength=num_grains) > 1


def box_of(path):
    """Cell matrix of a LAMMPS data file."""
    with open(path) as stream:
        head = [next(stream).split() for _ in range(12)]
    length = {words[2]: float(words[1]) - float(words[0]) for words in head if len(words) == 4 and words[2] in ("xlo", "ylo")}
    tilt = next(float(words[0]) for words in head if words[3:4] == ["xy"])
    return np.array([[length["xlo"], tilt], [0.0, length["ylo"]]])


# ---- the two codes ------------------------------------------------------------------------------------------------------------------


class Lammps:
    """Runs input scripts in a working directory."""

    def __init__(self, executable, plain, folder):
        self.executable, self.plain, self.folder = executable, plain, folder

    def path(self, name):
        return os.path.join(self.folder, name)

    def run(self, script, log, **variables):
        executable = self.plain if script == "in.grains_in_lammps" else self.executable
        command = [executable, "-in", os.path.join(HERE, script), "-log", log, "-screen", "none"]
        for name, value in variables.items():
            command += ["-var", name] + [str(v) for v in (value if isinstance(value, (tuple, list)) else [value])]
        # one process needs no daemon of Open MPI, which takes longer to start than most runs here
        environment = dict(os.environ, OMP_NUM_THREADS="1", OMPI_MCA_ess_singleton_isolated="1")
        if subprocess.run(command, cwd=self.folder, env=environment).returncode != 0:
            print("failed in", self.folder + ":", " ".join(command))
            sys.exit(2)
        return self.path(log)


def prepare(lmp, name, **variables):
    """A packing in both formats. write_rve lets the box of the data file lean by half of its width at most; here it gets the cell of
    fix rve back (the same lattice), so that LAMMPS runs with a tilt that fix rve reduces."""
    lmp.run("in.prepare", "log.prepare", packing=PACKING, out=name, **variables)
    packing, data = Packing(lmp.path(name + ".rve")), lmp.path(name + ".data")
    assert packing.cell[1, 0] == 0.0, "LAMMPS has no cell whose first vector is not along x"
    with open(data) as stream:
        text = stream.read()
    line = next(line for line in text.split("\n") if line.endswith("xy xz yz"))
    with open(data, "w") as stream:
        stream.write(text.replace(line, f"{packing.cell[0, 1].item()!r} 0 0 xy xz yz"))


class Run:
    """The grains of a packing in LAMMPS and in fix rve, and the deviations between them."""

    def __init__(self, lmp, state, drive="none", rate=0.0, box="late", steps=STEPS, every=0, law=None, arms="lammps"):
        self.lmp, self.rate, law = lmp, rate, law or {}
        self.viscous, self.rolling_friction = "gamma_n" in law, law.get("mu_r", 0.0)
        self.packing = Packing(lmp.path(state + ".rve"))
        log = lmp.run("in.grains_in_lammps", "log.lammps", start=state + ".data", drive=drive, rate=rate, box=box, steps=steps[-1],
                      every=every, out="lammps", **law)
        self.pressure = read_thermo(log)
        self.grains, rows = read_dump(lmp.path("lammps.grains")), read_dump(lmp.path("lammps.contacts"))
        self.contacts = {step: Contacts(frame) for step, frame in rows.items()}
        self.mass, self.radius = self.grains[0][:, 9], self.grains[0][:, 10]
        self.inertia = 0.5 * self.mass * self.radius**2

        # LAMMPS begins with half a kick by the forces at the start; fix rve begins with the velocities after it
        velocity, spin = self.half_kick(0, self.packing.velocity, self.packing.spin)
        self.packing.write(lmp.path("kicked.rve"), velocity, spin)
        log = lmp.run("in.grains_in_rve", "log.rve", start="kicked.rve", drive=drive, rate=rate, at=steps, out="rve", arms=arms,
                      write="no" if every else "yes", **law)
        self.stress = read_thermo(log)

        self.cell = self.packing.cell
        self.cell_rate = np.zeros((2, 2))
        if drive == "uniaxial":
            self.cell_rate[1, 1] = -rate * self.cell[1, 1]
        elif drive == "shear":
            self.cell_rate[0, 1] = rate * self.cell[1, 1]
        self.force = np.mean(np.linalg.norm(self.contacts[0].normal_force, axis=1))
        self.overlap = self.force / STIFFNESS
        self.speed = self.overlap * math.sqrt(STIFFNESS / self.mass.mean())

    def half_kick(self, step, velocity, spin):
        frame = self.grains[step]
        return velocity + 0.5 * DT * frame[:, 6:8] / self.mass[:, None], spin + 0.5 * DT * frame[:, 8] / self.inertia

    def cell_at(self, step):
        return self.cell + step * DT * self.cell_rate

    def box_per_step(self):
        """How far the box moves in one step, in mean overlaps."""
        return np.abs(self.cell_rate).max() * DT / self.overlap

    def volume(self, step):
        return np.linalg.det(self.cell_at(step)) * self.packing.thickness

    def rve_stress(self, step):
        xx, yy, xy, yx = self.stress[step][:4]
        return np.array([[xx, xy], [yx, yy]])

    def love_deviation(self, step):
        """Full Love tensor from the contacts of LAMMPS."""
        mine = self.rve_stress(step)
        return np.abs(self.contacts[step].love(self.volume(step)) - mine).max() / abs(0.5 * np.trace(mine))

    def virial_deviation(self, step):
        """Three components of compute pressure (its shear is l_x f_y), with the velocities that the dashpots saw."""
        mine = self.rve_stress(step)
        xx, yy, yx, area = self.pressure[step][:4]
        # the box of LAMMPS may be one step ahead, and its plane stress is per unit of thickness
        theirs = -np.array([xx, yy, yx]) * area / self.volume(step)
        return np.abs(theirs - np.array([mine[0, 0], mine[1, 1], mine[1, 0]])).max() / abs(0.5 * np.trace(mine))

    def compare(self, step):
        """{quantity: (deviation, how far the quantity itself has come since the start)} after a step."""
        mine, theirs, contacts = Packing(self.lmp.path(f"rve.{step}.rve")), self.grains[step], self.contacts[step]
        cell = self.cell_at(step)
        # the same lattice: cells differ by a matrix of integers
        change = np.linalg.solve(cell, mine.cell)
        carrying = contacts.carrying(len(theirs))

        def rms(values):
            values = values[carrying]
            return math.sqrt((values * values).sum() / len(values))

        # fix deform keeps the middle of the height where it is; a corner of the cell of fix rve is the origin
        corner = np.array([0.0, 0.5 * (self.cell[1, 1] - cell[1, 1])])
        position = theirs[:, 1:3] - corner
        fraction = np.linalg.solve(cell, position.T).T
        apart = self.nearest(position - mine.position, cell)
        start = np.linalg.solve(self.cell, self.packing.position.T).T
        moved = self.nearest(mine.position - start @ cell.T, cell)
        # the velocity of fix rve is half a step ahead, and relative to the mean field
        velocity, spin = self.half_kick(step, theirs[:, 3:5], theirs[:, 5])
        velocity = velocity - fraction @ self.cell_rate.T - np.array([0.0, -0.5 * self.cell_rate[1, 1]])
        result = {
            "cell": (np.abs(change - np.round(change)).max(), 1.0),
            "positions": (rms(apart) / self.overlap, rms(moved) / self.overlap),
            "velocities": (rms(velocity - mine.velocity) / self.speed, rms(mine.velocity) / self.speed),
            "spins": (rms(spin - mine.spin) * self.radius.mean() / self.speed, rms(mine.spin) * self.radius.mean() / self.speed)}
        change = np.abs(self.rve_stress(step) - self.rve_stress(0)).max() / abs(0.5 * np.trace(self.rve_stress(0)))
        if self.viscous:
            # the dashpots of pair/local see other velocities than those of the step
            result["stress"] = (self.virial_deviation(step), change)
        else:
            tangential = np.array([mine.tangential.get(key, 0.0) for key in contacts.pairs])
            result["tangential forces"] = tuple(math.sqrt(np.mean(f * f)) / self.force for f in (contacts.tangential - tangential, tangential))
            result["stress"] = (max(self.love_deviation(step), self.virial_deviation(step)), change)
        if self.rolling_friction:
            rolling = np.array([mine.rolling.get(key, 0.0) for key in contacts.pairs])
            result["rolling forces"] = tuple(math.sqrt(np.mean(f * f)) / self.force for f in (contacts.rolling - rolling, rolling))
        return result

    def at_rolling_limit(self, step):
        """Share of the contacts."""
        contacts = self.contacts[step]
        limit = self.rolling_friction * np.linalg.norm(contacts.normal_force, axis=1)
        return np.mean(np.abs(contacts.rolling) > (1.0 - 1e-9) * limit)

    @staticmethod
    def nearest(vector, cell):
        return vector - np.round(np.linalg.solve(cell, vector.T).T) @ cell.T


# ---- the comparisons ----------------------------------------------------------------------------------------------------------------


class Table:
    """Rows of deviations after some steps; a row passes if each of them is within its own tolerance."""

    def __init__(self):
        self.rows, self.failures = 0, []

    def title(self, text, columns):
        self.text, self.width = text, len(columns)
        print(f"\n{text}\n  {'':34}" + "".join(f"{column:>10}" for column in columns) + f"{'tolerance':>14}        reason")

    def row(self, what, values, sense, bound, passed, reason):
        self.rows += 1
        if not passed:
            self.failures.append(f"{self.text}: {what}")
        numbers = "".join(f"{value:10.1e}" for value in values)
        print(f"  {what:34}{numbers:>{10 * self.width}}  {sense:>3}{bound:9.1e}  {'PASS' if passed else 'FAIL'}  {reason}", flush=True)

    def within(self, what, values, tolerances, reason):
        """The tolerance that is shown is that of the last value."""
        self.row(what, values, "<=", tolerances[-1], all(v <= t for v, t in zip(values, tolerances)), reason)

    def at_least(self, what, values, bounds, reason):
        """The bound that is shown is that of the last value."""
        self.row(what, values, ">=", bounds[-1], all(v >= b for v, b in zip(values, bounds)), reason)


def columns(steps):
    return [f"step {step}" for step in steps]


def identical_configuration(table, lmp, state):
    table.title(f"{STATES[state]}: the same configuration, tangential forces zero", ["deviation"])
    run = Run(lmp, state, steps=(1,))
    contacts, frame = run.contacts[0], run.grains[0]
    exported = np.loadtxt(lmp.path(state + ".data.contacts"))
    normal = {pair(int(row[0]), int(row[1])): row[7] for row in exported}
    table.within("contacts that one code lacks", [len(set(contacts.pairs) ^ set(normal))], [0], "no touch is so light that rounding decides")
    theirs = np.linalg.norm(contacts.normal_force, axis=1)
    table.within("normal force, worst contact", [max(abs(f - normal.get(key, 0.0)) for f, key in zip(theirs, contacts.pairs)) / run.force],
                 [ROUNDING], "rounding of coordinates over the overlap")
    mine = run.rve_stress(0)
    table.within("Love stress, worst of four", [np.abs(contacts.love(run.volume(0)) - mine).max() / abs(0.5 * np.trace(mine))], [ROUNDING],
                 "the same")
    # the first kick of grains at rest tells the forces on them: c = dt F/m
    still = Packing(lmp.path(state + ".rve"))
    still.write(lmp.path("still.rve"), 0.0 * still.velocity, 0.0 * still.spin)
    lmp.run("in.grains_in_rve", "log.still", start="still.rve", at=1, out="still")
    kicked = Packing(lmp.path("still.1.rve"))
    force = kicked.velocity * run.mass[:, None] / DT
    table.within("force, worst grain", [np.abs(force - frame[:, 6:8]).max() / run.force], [ROUNDING], "the same")
    table.within("torque, worst grain", [max(np.abs(kicked.spin).max(), np.abs(frame[:, 8]).max())], [0.0], "no tangential force, no torque")


def name_of(law):
    return ", ".join(name for key, name in (("gamma_n", "viscous"), ("cundall", "Cundall damping"), ("mu_r", "rolling resistance")) if key in law)


def with_law(text, law):
    return f"{text}, {name_of(law)}" if law else text


def cell_at_rest(table, lmp, law=None):
    """Without deformation there is no difference but rounding. Returns the deviations of positions."""
    table.title(with_law(f"{STATES['moving']}: released in a cell at rest", law), columns(STEPS))
    run = Run(lmp, "moving", law=law)
    results = [run.compare(step) for step in STEPS]
    tolerances = [5 * ROUNDING if step <= 100 else GROWN_ROUNDING for step in STEPS]
    for name in results[0]:
        if name == "cell":
            table.within(name, [result[name][0] for result in results], [CELL_ROUNDING] * len(STEPS), "rounding")
        else:
            table.within(name, [result[name][0] for result in results], tolerances, "rounding; after 1000 steps grown by collisions")
    rolling_limit(table, run)
    return [result["positions"][0] for result in results]


def rolling_limit(table, run):
    """Both branches of the law must be in a comparison."""
    if run.rolling_friction:
        share = run.at_rolling_limit(STEPS[-1])
        table.at_least("contacts at the rolling limit, below", [share, 1.0 - share], [0.02, 0.02], "both branches of the law, after 1000 steps")


def deforming_cell(table, lmp, state, drive, boxes, law=None):
    """Trajectories at both rates. Returns {box: {rate: deviations of positions}}."""
    text = with_law(f"{STATES[state]}, {drive}", law)
    measured = {}
    for box in boxes:
        for rate in RATES:
            table.title(f"{text}, {rate}/s, box {BOXES[box]}", columns(STEPS))
            run = Run(lmp, state, drive, rate, box, law=law)
            results = [run.compare(step) for step in STEPS]
            for name in results[0]:
                tolerances, reason = trajectory_tolerance(run, box, name, results)
                table.within(name, [result[name][0] for result in results], tolerances, reason)
            rolling_limit(table, run)
            measured.setdefault(box, {})[rate] = results
            reductions, cell = run.stress[STEPS[-1]][4], run.cell_at(STEPS[-1])
            if state == "leaning":
                table.at_least("lattice reductions", [reductions], [1], f"xy/lx of LAMMPS at the end: {cell[0, 1] / cell[0, 0]:.4f}")

    table.title(f"{text}: deviations at {RATES[0]}/s over those at {RATES[1]}/s", columns(STEPS[1:]))
    for box in boxes:
        for name in ("positions", "stress"):
            fast, slow = ([results[name][0] for results in measured[box][rate][1:]] for rate in RATES)
            bounds = [LEAST_RATIO[step] if box == "late" or step <= 100 else 0.0 for step in STEPS[1:]]
            table.at_least(f"{name}, box {BOXES[box]}", [f / s for f, s in zip(fast, slow)], bounds, RATIO_REASON[box])
    return {box: {rate: [result["positions"][0] for result in results] for rate, results in of_box.items()}
            for box, of_box in measured.items()}


def trajectory_tolerance(run, box, name, results):
    if name == "cell":
        return [CELL_ROUNDING] * len(STEPS), "rounding of 1000 increments"
    if box == "late":
        late = run.box_per_step()
        if name == "stress":
            return [0.1 * late] * len(STEPS), "the same, for the tenth of the contacts that cross the boundary"
        return [late] * len(STEPS), "as far as the box moves in a step, in overlaps"
    strain = [run.rate * step * DT for step in STEPS]
    shaken = [COLLISIONS if step > 100 and name in ("velocities", "spins") else 1 for step in STEPS]
    tolerances = [k * e * result[name][1] + 5 * ROUNDING for k, e, result in zip(shaken, strain, results)]
    return tolerances, "no L.c in LAMMPS: strain times change since the start" + (f", after 1000 steps x {COLLISIONS}" if max(shaken) > 1 else "")


def other_arms(table, lmp):
    """The table must be able to tell two contact laws apart."""
    steps = (10, 100)
    table.title(f"{STATES['isotropic']}, shear, {RATES[0]}/s, box {BOXES['in_time']}: fix rve with arms contact", columns(steps))
    run = Run(lmp, "isotropic", "shear", RATES[0], "in_time", steps=(1,) + steps, arms="contact")
    results = [run.compare(step) for step in steps]
    for name in ("spins", "tangential forces"):
        noticed = [result[name][0] / (RATES[0] * step * DT * result[name][1] + 5 * ROUNDING) for step, result in zip(steps, results)]
        table.at_least(f"{name}, over tolerance", noticed, [10.0] * len(noticed), "another law must fail: arms r - overlap/2 in velocities")


def stress_strain_curve(table, lmp, drive, law):
    """Returns {rate: (strain, stress of LAMMPS, stress of fix rve, deviation)}."""
    curves, medians = {}, []
    for rate in RATES:
        total = round(CURVE_STRAIN / rate / DT)
        every = total // CURVE_POINTS
        steps = tuple(range(every, total + 1, every))
        run = Run(lmp, "isotropic", drive, rate, steps=steps, every=every, law=law)
        curves[rate] = (np.array(steps) * rate * DT, np.array([run.contacts[s].love(run.volume(s)) for s in steps]),
                        np.array([run.rve_stress(s) for s in steps]), np.array([run.love_deviation(s) for s in steps]))
        late = run.box_per_step()
        if rate == RATES[0]:
            table.title(f"{STATES['isotropic']}, {drive}, {name_of(law)}: stress-strain curves, largest deviation of Love's stress",
                        ["to 1 %", "to 2 %"])
        strain, _, _, deviation = curves[rate]
        early = strain < 0.01 + 1e-9
        table.within(f"{rate}/s", [deviation[early].max(), deviation.max()], [0.1 * late, 0.1 * late + SCATTER[drive]],
                     "box one step late; beyond 1 % also contacts that are lost at other moments")
        medians.append(np.median(deviation[early]))
    table.at_least("ratio of medians, to 1 %", [medians[0] / medians[1]], [LEAST_RATIO[10]], "linear in the rate gives 10")
    return curves


def plot(path, rounding, trajectories, curves):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 4))
    left.loglog(STEPS, rounding, "k:", marker=".", label="cell at rest")
    for box, style in (("late", "-"), ("in_time", "--")):
        for rate, color in zip(RATES, ("C3", "C0")):
            left.loglog(STEPS, trajectories[box][rate], style, color=color, marker=".", label=f"{rate}/s, box {BOXES[box]}")
    left.set(xlabel="step", ylabel="rms deviation of positions [mean overlaps]", title="motion, simple shear, undamped")
    left.set_ylim(bottom=1e-19)    # room for the legend
    left.legend(fontsize=8, loc="lower right")

    for k, ((drive, name), of_rate) in enumerate(curves.items()):
        strain, theirs, mine, _ = of_rate[RATES[0]]
        middle.plot(100 * strain, stress_ratio(mine), f"C{k}-", label=f"{drive}, {name}")
        middle.plot(100 * strain, stress_ratio(theirs), f"C{k}o", markersize=3, fillstyle="none")
        for rate, style in zip(RATES, ("-", "--")):
            strain, _, _, deviation = of_rate[rate]
            right.semilogy(100 * strain, deviation, style, color=f"C{k}")
    middle.set(xlabel="strain [%]", ylabel="q/p [-]", title=f"{RATES[0]}/s: fix rve (lines), LAMMPS (circles)", ylim=(0, None))
    middle.legend(fontsize=8)
    right.set(xlabel="strain [%]", ylabel="deviation of stress [mean stress]", title=f"{RATES[0]}/s (solid), {RATES[1]}/s (dashed)")
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    print("wrote", path)


def stress_ratio(stress):
    mean = 0.5 * np.trace(stress, axis1=1, axis2=2)
    deviator = stress - mean[:, None, None] * np.eye(2)
    return np.sqrt(0.5 * (deviator**2).sum(axis=(1, 2))) / -mean


def check(table, lmp, options):
    states = ("moving", "leaning") if options.short else tuple(STATES)
    prepare(lmp, "isotropic")
    prepare(lmp, "moving", shear=0.01, steps=4000)
    box = box_of(lmp.path("isotropic.data"))
    if "oblique" in states:
        prepare(lmp, "oblique", shear=0.3, mu=0, rest=20000)
    # fix rve reduces the lattice when it leans by 0.6
    prepare(lmp, "leaning", shear=0.5999 * box[0, 0] / box[1, 1], mu=0, rest=20000)

    for state in states:
        identical_configuration(table, lmp, state)
    rounding = cell_at_rest(table, lmp)
    cell_at_rest(table, lmp, VISCOUS)
    cell_at_rest(table, lmp, ROLLING)
    both = ("late", "in_time")
    trajectories = deforming_cell(table, lmp, "isotropic", "shear", both)
    if options.short:
        deforming_cell(table, lmp, "leaning", "shear", ("in_time",))
        return
    other_arms(table, lmp)
    deforming_cell(table, lmp, "isotropic", "uniaxial", both)
    deforming_cell(table, lmp, "isotropic", "shear", both, VISCOUS)
    deforming_cell(table, lmp, "isotropic", "uniaxial", both, VISCOUS)
    deforming_cell(table, lmp, "isotropic", "shear", both, ROLLING)
    deforming_cell(table, lmp, "isotropic", "uniaxial", both, ROLLING)
    deforming_cell(table, lmp, "oblique", "shear", both)
    deforming_cell(table, lmp, "leaning", "shear", both)
    curves = {(drive, name_of(law)): stress_strain_curve(table, lmp, drive, law)
              for law in (VISCOUS, CUNDALL, {**VISCOUS, **ROLLING}) for drive in ("uniaxial", "shear")}
    if options.figure:
        plot(options.figure, rounding, trajectories, curves)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lmp", help="LAMMPS with the packages GPU_RVE and GRANULAR (default: the newest of build/*/bin/lmp, or lmp on the PATH)")
    parser.add_argument("--plain", help="LAMMPS with the package GRANULAR, for the side of LAMMPS (default: the same)")
    parser.add_argument("--short", action="store_true", help="a part of the comparisons, without curves")
    parser.add_argument("--figure", metavar="FILE.png", help="draw a figure into this file (needs matplotlib); not with --short")
    parser.add_argument("--dir", help="keep what the runs write in this directory")
    options = parser.parse_args()
    if options.figure and options.short:
        parser.error("--figure needs the curves, which --short leaves out")
    executable = harness.find_lmp(options.lmp)
    plain = harness.find_lmp(options.plain, "--plain") if options.plain else executable
    if options.dir:
        os.makedirs(options.dir, exist_ok=True)

    table = Table()
    with tempfile.TemporaryDirectory() as folder:
        check(table, Lammps(executable, plain, os.path.abspath(options.dir or folder)), options)
    print(f"\n{table.rows - len(table.failures)} of {table.rows} rows passed")
    for failure in table.failures:
        print("FAIL ", failure)
    return 1 if table.failures else 0


if __name__ == "__main__":
    sys.exit(main())
