// SPDX-License-Identifier: GPL-2.0-only
// The DEM time step of fix rve through LAMMPS scripts. The tests check which RVE determines the
// stability bound and when the fix checks the bound. They run on one and on several ranks.

#include "engine/test_states.h"
#include "fix_rve_impl.h"
#include "rve/core/threads.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/stability.h"
#include "script.h"
#include "support/files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

using namespace LAMMPS_NS;
using rve_test::temporary_path;
using rve_test::text_of;

namespace {

#define EXPECT_IN(part, whole) EXPECT_PRED_FORMAT2(::testing::IsSubstring, part, whole)

// If the ratio of the automatic time step to the stability bound exceeds this number, the check
// lowers the step.
constexpr double MARGIN = 0.95;

const std::string TWO_ATOMS = R"(units si
dimension 2
boundary p p p
atom_style atomic
region box block 0 2 0 1 -0.5 0.5
create_box 1 box
mass 1 1.0
timestep 1e-3
create_atoms 1 single 0.5 0.5 0
create_atoms 1 single 1.5 0.5 0
variable second atom id-1
)";

/// Returns a packing with many contacts, whose stiffness is a tenth of that of loose_packing().
std::string soft_packing()
{
  const std::string path = file_of_rank("soft.rve");
  rve::write_packing(path, rve::read_packing(EXAMPLE_PACKINGS "/A_h1.rve"));
  return path;
}

/// Returns stiff grains in a cell that has been expanded, so that they hardly touch.
std::string loose_packing()
{
  rve::RveState state = rve::read_packing(EXAMPLE_PACKINGS "/A20_h0075.rve");
  state.material.normal_stiffness *= 10.0;
  state.material.tangential_stiffness *= 10.0;
  state.cell = 1.004 * state.cell;
  const std::string path = file_of_rank("loose.rve");
  rve::write_packing(path, state);
  return path;
}

class TimeStepScript : public Script {
 public:
  using Script::Script;

  double step() { return fix_value("grains", 8); }

  rve::RveState state(tagint id)
  {
    return dynamic_cast<FixRve *>(lmp->modify->get_fix_by_id("grains"))
        ->rves_of<2>()
        .state(local(id));
  }
  /// Returns the stability bound of the time step of an RVE, on every rank.
  double bound(tagint id)
  {
    double mine = local(id) < 0 ? 0.0 : rve::stable_time_step(state(id)), bound;
    MPI_Allreduce(&mine, &bound, 1, MPI_DOUBLE, MPI_MAX, lmp->world);
    return bound;
  }

 private:
  int local(tagint id) const
  {
    for (int i = 0; i < lmp->atom->nlocal; ++i)
      if (lmp->atom->tag[i] == id) return i;
    return -1;
  }
};

std::string two_packings(const std::string &rest)
{
  return TWO_ATOMS + "fix grains all rve " + soft_packing() + " packings " + loose_packing() +
      " packing_variable v_second threads 1 substeps 10 " + rest + "\n";
}

/// Returns the file of a packing of disks with Hertz contacts. Under pressure the contacts stiffen,
/// while their number hardly changes. Each rank makes its packing once.
std::string hertz_packing()
{
  static const std::string path = [] {
    const std::string made = file_of_rank("hertz.rve");
    Script script(MPI_COMM_SELF);
    script << "units si\ncreate_rve " + made +
            " grains 60 seed 3 radius uniform 0.0025 0.005 density 2650 damping 0.3 pressure 2e4 "
            "thickness 0.075 contact hertz 5e9 0.0 tangential mindlin/force 4e9 0.5 0.5 "
            "damping velocity";
    return made;
  }();
  return path;
}

/// Returns a script with one RVE with Hertz contacts. The RVE is compressed for 40 steps and then
/// held.
std::string hertz_compressed(const std::string &words)
{
  return "units si\ndimension 2\nboundary p p p\natom_style atomic\n"
         "region box block 0 1 0 1 -0.5 0.5\ncreate_box 1 box\nmass 1 1.0\ntimestep 2e-4\n"
         "create_atoms 1 single 0.5 0.5 0\nvariable rate equal -3*(step<40)\n"
         "fix grains all rve " +
      hertz_packing() + " threads 1 drive velocity_gradient xx v_rate yy v_rate " + words +
      "\ncompute pressure all rve/atom p\ncompute kinetic all rve/atom kinetic\n";
}

/// Returns the step of a message with "at step N:" or "at step N;".
long step_in(const std::string &message)
{
  const std::string before = "at step ";
  const std::size_t place = message.find(before);
  return place == std::string::npos ? -1 : std::stol(message.substr(place + before.size()));
}

/// Strain rates that compress the second RVE until it is dense.
const std::string COMPRESS = "variable rate atom -0.5*(id-1)\n";

}    // namespace

TEST(TimeStep, IsThatOfTheStiffestNetwork)
{
  TimeStepScript script;
  script << COMPRESS +
          two_packings("dt auto 0.9 dt_check 20 drive velocity_gradient xx v_rate yy v_rate");
  const double at_first = script.step();

  script << "run 100";

  EXPECT_LT(script.bound(2), script.bound(1));
  EXPECT_LT(script.step(), 0.9 * at_first);
  EXPECT_LE(script.step(), script.bound(2));
  EXPECT_GE(script.step(), 0.8 * MARGIN * script.bound(2));
}

TEST(TimeStep, OfTheUserEndsTheRunIfOneNetworkIsUnstable)
{
  TimeStepScript probe(MPI_COMM_SELF);
  probe << two_packings("dt auto 0.94");
  const std::string dt = std::to_string(1e6 * probe.step());

  const std::string message = message_of(
      COMPRESS +
      two_packings("dt " + dt + "e-6 dt_check 20 drive velocity_gradient xx v_rate yy v_rate") +
      "run 100");

  EXPECT_IN("is above the stability bound", message);
  EXPECT_IN("of the RVE of atom 2 at step", message);
}

// The first RVE exceeds its overlap limit and is frozen. At that time it has more contacts than the
// second RVE.
TEST(TimeStep, FrozenRveDoesNotHideOthers)
{
  TimeStepScript script;
  script << "variable rate atom -0.5*(id==2)-20*(id==1)\n" +
          two_packings("dt auto 0.9 dt_check 20 policy freeze overlap_limit 0.1 "
                       "drive velocity_gradient xx v_rate yy v_rate");

  script << "run 100";

  EXPECT_EQ(script.fix_value("grains", 2), 1.0);
  EXPECT_LE(script.step(), script.bound(2));
  EXPECT_GE(script.step(), 0.8 * MARGIN * script.bound(2));
}

// A loose packing allows a long time step. When the packing is dense, this step is too long. It
// must decrease before the next regular check.
TEST(TimeStep, FollowsNewContactsBeforeTheNextCheck)
{
  TimeStepScript script;
  script << COMPRESS +
          two_packings("dt auto 0.9 dt_check 1000 drive velocity_gradient xx v_rate yy v_rate");
  const double at_first = script.step();

  script << "run 120";

  EXPECT_LT(script.step(), 0.9 * at_first);
  EXPECT_LE(script.step(), script.bound(2));
}

// Hertz contacts stiffen while their number is constant. If the automatic time step decreased only
// at the next regular check, the compressed and held packing would keep a kinetic energy of 0.06 J.
TEST(TimeStep, FollowsStiffeningContactsBeforeTheNextCheck)
{
  TimeStepScript script(MPI_COMM_SELF), checked_every_step(MPI_COMM_SELF);
  script << hertz_compressed("dt auto 0.9 dt_check 1000");
  checked_every_step << hertz_compressed("dt auto 0.9 dt_check 1");
  const double at_first = script.step();

  for (int k = 0; k < 8; ++k) {
    script << "run 10";
    EXPECT_LE(script.step(), script.bound(1)) << "after run " << k;
  }
  checked_every_step << "run 80";

  EXPECT_LT(script.step(), 0.9 * at_first);
  EXPECT_NEAR(script.bound(1) / checked_every_step.bound(1), 1.0, 1e-3);
  EXPECT_NEAR(script.compute("pressure")[1] / checked_every_step.compute("pressure")[1], 1.0, 1e-3);
  EXPECT_LT(script.compute("kinetic")[1], 1e-6);
}

TEST(TimeStep, OfADividedRunOfHertzContactsIsThatOfTheWhole)
{
  TimeStepScript whole(MPI_COMM_SELF), parts(MPI_COMM_SELF);

  whole << hertz_compressed("dt auto 0.9") + "run 60";
  parts << hertz_compressed("dt auto 0.9") + "run 17\nrun 20\nrun 23";

  EXPECT_EQ(whole.step(), parts.step());
  EXPECT_EQ(rve::serialize(whole.state(1)), rve::serialize(parts.state(1)));
}

// If the time step of the user becomes too large, the run must end in that step, whatever the
// interval of regular checks is.
TEST(TimeStep, OfTheUserEndsTheRunAsSoonAsContactsHaveStiffened)
{
  TimeStepScript probe(MPI_COMM_SELF);
  probe << hertz_compressed("dt auto 0.9");
  const std::string dt = "dt " + std::to_string(1e9 * probe.step()) + "e-9 ";

  const std::string late = message_of(hertz_compressed(dt + "dt_check 1000") + "run 40"),
                    soon = message_of(hertz_compressed(dt + "dt_check 1") + "run 40");

  EXPECT_IN("is above the stability bound", late);
  EXPECT_GT(step_in(soon), 0);
  // Between regular checks, the fix checks the bound when the contact force has increased by a
  // third. The run can therefore end a few steps later.
  EXPECT_LE(step_in(late), step_in(soon) + 3);
}

// One LAMMPS step has so many DEM steps that contacts stiffen during the step.
TEST(TimeStep, WarnsIfContactsStiffenWithinOneStep)
{
  {
    Script script(MPI_COMM_SELF, file_of_rank("log.within"));
    script << hertz_compressed("dt auto 0.9") + "timestep 2e-3\nrun 10";
  }
  EXPECT_IN("which stiffened within one step", text_of(file_of_rank("log.within")));
}

TEST(TimeStep, DoesNotDependOnRanks)
{
  const std::string lines = COMPRESS +
      two_packings("dt auto 0.9 dt_check 20 drive velocity_gradient xx v_rate yy v_rate") +
      "run 60";
  TimeStepScript together, alone(MPI_COMM_SELF);

  together << lines;
  alone << lines;

  EXPECT_EQ(together.step(), alone.step());
  EXPECT_EQ(together.bound(2), alone.bound(2));
}

// The checks at the beginning and at the end of a run change nothing. A divided run must therefore
// equal the whole run.
TEST(TimeStep, OfADividedRunIsThatOfTheWhole)
{
  const std::string lines = COMPRESS +
      two_packings("dt auto 0.9 dt_check 50 drive velocity_gradient xx v_rate yy v_rate");
  TimeStepScript whole, parts;

  whole << lines + "run 120";
  parts << lines + "run 33\nrun 33\nrun 54";

  EXPECT_EQ(whole.step(), parts.step());
  EXPECT_EQ(whole.bound(2), parts.bound(2));
}

TEST(TimeStep, RestartKeepsItsChecks)
{
  const std::string lines = COMPRESS +
      two_packings("dt auto 0.9 dt_check 50 drive velocity_gradient xx v_rate yy v_rate");
  const std::string path = temporary_path("checks.restart");
  TimeStepScript whole;
  whole << lines + "run 37\nwrite_restart " + path + "\nrun 83";

  TimeStepScript continued;
  continued << "read_restart " + path + "\ntimestep 1e-3\nvariable second atom id-1\n" +
          lines.substr(lines.find("variable rate"), lines.find('\n')) + "\n" +
          lines.substr(lines.find("fix grains")) + "run 83";

  EXPECT_EQ(whole.step(), continued.step());
  EXPECT_EQ(whole.bound(2), continued.bound(2));
}

TEST(TimeStep, WarningsComeInRunsShorterThanTheInterval)
{
  {
    Script script(MPI_COMM_SELF, file_of_rank("log.short"));
    script << TWO_ATOMS +
            "fix grains all rve " EXAMPLE_PACKINGS
            "/A_h0075.rve threads 1 dt 1e-4 drive velocity_gradient yy -5\nrun 20";
  }
  EXPECT_IN("the inertial number is", text_of(file_of_rank("log.short")));
}

// A LAMMPS step of 1e-3 with DEM steps of at most 9.5e-5 has eleven DEM steps.
TEST(TimeStep, FailureReportsTheUsedStep)
{
  const std::string message = message_of(TWO_ATOMS +
                                         "fix grains all rve " EXAMPLE_PACKINGS
                                         "/A_h0075.rve threads 1 dt 9.5e-5 overlap_limit 0.1 "
                                         "drive velocity_gradient yy -400\nrun 20");

  EXPECT_IN("overlap too large", message);
  EXPECT_IN("DEM time step 9.0909", message);
}

/// Returns the log of a run with the DEM time step `dt`. Two equal disks with dashpots collide at
/// an angle.
static std::string log_of_collision(const std::string &dt)
{
  rve::Material material = rve_test::paper_material();
  material.local_damping = 0.0;
  material.normal_viscosity = 300.0;
  material.tangential_viscosity = 200.0;
  rve::RveState state = rve_test::approaching_disks(0.005, material, 0.1);
  state.velocity[3] = 0.05;
  state.velocity[1] = -0.05;
  const std::string packing = file_of_rank("disks.rve"), log = file_of_rank("log.balance");
  rve::write_packing(packing, state);
  {
    Script script(MPI_COMM_SELF, log);
    script << TWO_ATOMS + "fix grains all rve " + packing + " threads 1 energy yes dt " + dt +
            " drive velocity_gradient xx 0\nrun 40";
  }
  return text_of(log);
}

// If a contact lasts only few DEM steps, the time integration loses energy that no dashpot
// dissipates. The energy balance shows this loss.
TEST(TimeStep, WarnsOfAnOpenEnergyBalance)
{
  const std::string warning = "the error of the energy balance is";

  EXPECT_IN(warning, log_of_collision("auto 0.9"));
  EXPECT_EQ(log_of_collision("auto 0.05").find(warning), std::string::npos);
}
