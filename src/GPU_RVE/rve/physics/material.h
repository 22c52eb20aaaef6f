// What grains are made of: the parameters of their contacts and of their motion, each said once. Checks, packing files, restart records,
// keywords of scripts and the memory of an RVE follow from this table. Plain data, outside of the instruction-set namespaces.

#ifndef RVE_PHYSICS_MATERIAL_H
#define RVE_PHYSICS_MATERIAL_H

namespace rve {

/// Consistent units, as given by the script. In the order of restart records.
struct MaterialNumbers {
  double normal_stiffness;        ///< k_n [force/length]
  double tangential_stiffness;    ///< k_t [force/length]
  double friction;                ///< Coulomb coefficient mu [-]
  double
      rolling_stiffness;      ///< k_r, of the rolling displacement [force/length]; 0: no resistance
  double rolling_friction;    ///< mu_r, rolling force at most mu_r f_n [-]; 0: no resistance
  double density;             ///< of the grain material [mass/length^3]
  double local_damping;       ///< Cundall's alpha_d of equation (4) [-]
  double normal_viscosity;    ///< gamma_n, LAMMPS `damping velocity` [force time/length]
  double tangential_viscosity;    ///< gamma_t [force time/length]
  double thickness;               ///< of the disks, enters the stress volume only [length]
  double mass_depth;              ///< out-of-plane depth that the mass is counted for [length]
};

/// Nothing yet, for disks of unit thickness.
struct Material : MaterialNumbers {
  constexpr Material() : MaterialNumbers{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0} {}
};

/// Values that a parameter may have.
enum class MaterialRange {
  Positive,       ///< above 0
  NotNegative,    ///< 0 and above
  Friction,    ///< 0 to 1e10: beyond it forces along contacts have no digits in common with those across them
  Fraction    ///< [0, 1)
};

/// Written in place, nvcc hands g++ parentheses around the member's name that g++ warns of.
using MaterialMember = double MaterialNumbers::*;

struct MaterialParameter {
  const char *name;       ///< in packing files
  const char *keyword;    ///< in scripts
  const char *what;       ///< in messages
  const char *unit;
  MaterialRange range;
  bool of_contact;    ///< of the contact law, not of the grains
  bool
      optional;    ///< in packing files: written when it or another one is not zero, and zero where it is not given
  MaterialMember member;
};

/// In the order of packing files.
constexpr MaterialParameter MATERIAL_PARAMETERS[] = {
    // clang-format off
    {"normal_stiffness", "kn", "normal stiffness", "[force/length]", MaterialRange::Positive, true, false, &MaterialNumbers::normal_stiffness},
    {"tangential_stiffness", "kt", "tangential stiffness", "[force/length]", MaterialRange::NotNegative, true, false, &MaterialNumbers::tangential_stiffness},
    {"friction", "friction", "friction coefficient", "[-]", MaterialRange::Friction, true, false, &MaterialNumbers::friction},
    {"density", "density", "grain density", "[mass/length^3]", MaterialRange::Positive, false, false, &MaterialNumbers::density},
    {"local_damping", "damping", "local damping", "[-]", MaterialRange::Fraction, false, false, &MaterialNumbers::local_damping},
    {"normal_viscosity", "gamma_n", "normal viscosity", "[force time/length]", MaterialRange::NotNegative, true, false, &MaterialNumbers::normal_viscosity},
    {"tangential_viscosity", "gamma_t", "tangential viscosity", "[force time/length]", MaterialRange::NotNegative, true, false, &MaterialNumbers::tangential_viscosity},
    {"thickness", "thickness", "thickness", "[length]", MaterialRange::Positive, false, false, &MaterialNumbers::thickness},
    {"mass_depth", "mass_depth", "mass depth times mass scaling", "[length]", MaterialRange::Positive, false, false, &MaterialNumbers::mass_depth},
    {"rolling_stiffness", "kr", "rolling stiffness", "[force/length]", MaterialRange::NotNegative, true, true, &MaterialNumbers::rolling_stiffness},
    {"rolling_friction", "rolling_friction", "rolling friction coefficient", "[-]", MaterialRange::Friction, true, true, &MaterialNumbers::rolling_friction},
    // clang-format on
};

}    // namespace rve

#endif
