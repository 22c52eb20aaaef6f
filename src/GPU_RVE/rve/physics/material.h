// SPDX-License-Identifier: GPL-2.0-only
// Material of grains: the parameters of their contacts and of their motion. The table
// MATERIAL_PARAMETERS is the only list of parameters: checks, packing files, restart records,
// keywords of scripts and the stored state of an RVE follow from it. The structs are plain data,
// outside of the instruction-set namespaces.

#pragma once

namespace rve {

/// Laws of contacts. Rolling resistance is not a law of its own: each law may have it.
enum class ContactLaw { Linear, Hertz, Dmt };

/// Names of the laws in packing files and scripts, in the order of ContactLaw. LAMMPS uses the same
/// names.
constexpr const char *CONTACT_LAW_WORDS[] = {"hooke", "hertz", "dmt"};

constexpr const char *word_of(ContactLaw law)
{
  return CONTACT_LAW_WORDS[static_cast<int>(law)];
}

/// Parameters in the consistent units of the script, in the order of restart records.
struct MaterialNumbers {
  double normal_stiffness;        ///< k_n [force/length]
  double tangential_stiffness;    ///< k_t [force/length]
  double friction;                ///< Coulomb coefficient mu [-]
  /// k_r of the rolling displacement [force/length]; 0: no resistance.
  double rolling_stiffness;
  double rolling_friction;        ///< mu_r, rolling force at most mu_r f_n [-]; 0: no resistance
  double density;                 ///< of the grain material [mass/length^3]
  double local_damping;           ///< Cundall's alpha_d of equation (4) [-]
  double normal_viscosity;        ///< gamma_n, LAMMPS `damping velocity` [force time/length]
  double tangential_viscosity;    ///< gamma_t [force time/length]
  double thickness;               ///< of disks; only the stress volume depends on it [length]
  double mass_depth;              ///< out-of-plane depth for the mass [length]
  double hertz_stiffness;         ///< k_n = 4/3 E* [force/length^2]
  double mindlin_stiffness;       ///< k_t = 8 G* [force/length^2]
  double viscoelastic_damping;    ///< eta of gamma = eta m a [1/(length time)]
  double restitution_damping;     ///< c of gamma = c sqrt(m k_n a) [-]
  double mindlin_damping;         ///< gamma_t / gamma [-]
  /// Quantity that a contact keeps while its radius changes. 1: the tangential displacement; 0: the
  /// tangential force. 3 and 2: as 1 and 0, but the kept quantity decreases while the contact
  /// shrinks.
  double mindlin_displacement;
  double surface_energy;        ///< w of the attraction 4 pi w R [force/length]
  double twisting_stiffness;    ///< k_q of the twisting angle [force length]; 0: no resistance
  /// mu_q: the twisting moment is at most mu_q times the force that limits friction [length]; 0: no
  /// resistance.
  double twisting_friction;
  double rolling_viscosity;     ///< gamma_r of the rolling velocity [force time/length]
  double twisting_viscosity;    ///< gamma_q of the twisting velocity [force length time]
  /// 1: objective local damping; 0: Cundall's, which damps each component [-].
  double objective_damping;
  /// 1: friction over the area of contact resists twisting; 0: k_q and mu_q resist it [-].
  double twisting_marshall;
  /// h, the distance up to which grains attract each other [length]; 0: only while they touch.
  double adhesion_reach;
};

/// Material of the grains of an RVE. Its default is unit thickness and mass depth; all other
/// numbers are zero.
struct Material : MaterialNumbers {
  ContactLaw law = ContactLaw::Linear;    ///< parameters of other laws are zero

  constexpr Material() : MaterialNumbers{} { thickness = mass_depth = 1.0; }
};

/// Allowed values of a parameter.
enum class MaterialRange {
  Positive,       ///< above 0
  NotNegative,    ///< 0 and above
  /// 0 to 1e10: with a larger coefficient the digits of normal and tangential forces do not
  /// overlap.
  Friction,
  Fraction,    ///< [0, 1)
  Choice,      ///< 0, 1, 2 or 3
  Switch       ///< 0 or 1
};

/// Set of contact laws that have a parameter, with one bit for each law. The set is empty for a
/// parameter of the grains.
using LawSet = unsigned;
constexpr LawSet OF_GRAINS = 0, OF_ALL_LAWS = ~LawSet(0);
constexpr LawSet of_law(ContactLaw law)
{
  return LawSet(1) << static_cast<int>(law);
}

constexpr LawSet OF_LINEAR = of_law(ContactLaw::Linear), OF_DMT = of_law(ContactLaw::Dmt);
/// Laws of Hertz' contact, with and without adhesion.
constexpr LawSet OF_HERTZ = of_law(ContactLaw::Hertz) | OF_DMT;

/// Pointer to a parameter. The alias avoids a warning of g++: nvcc would write parentheses around
/// the name of the member.
using MaterialMember = double MaterialNumbers::*;

struct MaterialParameter {
  const char *name;       ///< name in packing files
  const char *keyword;    ///< keyword in scripts
  const char *what;       ///< description in messages
  const char *unit;
  MaterialRange range;
  LawSet laws;
  /// True if packing files are allowed to omit the parameter, which is then zero. A file contains
  /// all optional parameters of a material, except those with `later`, if any optional one is not
  /// zero.
  bool optional;
  MaterialMember member;
  int dimension = 0;    ///< dimension of grains that have the parameter; 0: both
  /// True if the parameter is newer than the formats of files and records. They contain such a
  /// parameter only if it is not zero.
  bool later = false;

  constexpr bool of_contact() const { return laws != OF_GRAINS; }
  /// Returns whether a material of this law has the parameter, for disks or spheres.
  constexpr bool is_of(ContactLaw law, int of_dimension = 2) const
  {
    return (dimension == 0 || dimension == of_dimension) &&
        (!of_contact() || (laws & of_law(law)) != 0);
  }
};

/// All parameters, in the order of packing files.
constexpr MaterialParameter MATERIAL_PARAMETERS[] = {
    // clang-format off
    {"normal_stiffness", "kn", "normal stiffness", "[force/length]",
     MaterialRange::Positive, OF_LINEAR, false, &MaterialNumbers::normal_stiffness},
    {"tangential_stiffness", "kt", "tangential stiffness", "[force/length]",
     MaterialRange::NotNegative, OF_LINEAR, false, &MaterialNumbers::tangential_stiffness},
    {"friction", "friction", "friction coefficient", "[-]",
     MaterialRange::Friction, OF_ALL_LAWS, false, &MaterialNumbers::friction},
    {"density", "density", "grain density", "[mass/length^3]",
     MaterialRange::Positive, OF_GRAINS, false, &MaterialNumbers::density},
    {"local_damping", "damping", "local damping", "[-]",
     MaterialRange::Fraction, OF_GRAINS, false, &MaterialNumbers::local_damping},
    {"normal_viscosity", "gamma_n", "normal viscosity", "[force time/length]",
     MaterialRange::NotNegative, OF_LINEAR | OF_HERTZ, false, &MaterialNumbers::normal_viscosity},
    {"tangential_viscosity", "gamma_t", "tangential viscosity", "[force time/length]",
     MaterialRange::NotNegative, OF_LINEAR, false, &MaterialNumbers::tangential_viscosity},
    {"thickness", "thickness", "thickness", "[length]",
     MaterialRange::Positive, OF_GRAINS, false, &MaterialNumbers::thickness},
    {"mass_depth", "mass_depth", "mass depth times mass scaling", "[length]",
     MaterialRange::Positive, OF_GRAINS, false, &MaterialNumbers::mass_depth},
    {"rolling_stiffness", "kr", "rolling stiffness", "[force/length]",
     MaterialRange::NotNegative, OF_ALL_LAWS, true, &MaterialNumbers::rolling_stiffness},
    {"rolling_friction", "rolling_friction", "rolling friction coefficient", "[-]",
     MaterialRange::Friction, OF_ALL_LAWS, true, &MaterialNumbers::rolling_friction},
    {"hertz_stiffness", "hertz_kn", "Hertz' stiffness", "[force/length^2]",
     MaterialRange::Positive, OF_HERTZ, false, &MaterialNumbers::hertz_stiffness},
    {"mindlin_stiffness", "mindlin_kt", "Mindlin's stiffness", "[force/length^2]",
     MaterialRange::NotNegative, OF_HERTZ, false, &MaterialNumbers::mindlin_stiffness},
    {"viscoelastic_damping", "viscoelastic_damping", "viscoelastic damping", "[1/(length time)]",
     MaterialRange::NotNegative, OF_HERTZ, false, &MaterialNumbers::viscoelastic_damping},
    {"restitution_damping", "restitution_damping", "damping by restitution", "[-]",
     MaterialRange::NotNegative, OF_HERTZ, false, &MaterialNumbers::restitution_damping},
    {"mindlin_damping", "mindlin_damping", "tangential over normal damping", "[-]",
     MaterialRange::NotNegative, OF_HERTZ, false, &MaterialNumbers::mindlin_damping},
    {"mindlin_displacement", "mindlin_displacement", "choice of a displacement that is kept", "[-]",
     MaterialRange::Choice, OF_HERTZ, false, &MaterialNumbers::mindlin_displacement},
    {"surface_energy", "surface_energy", "surface energy", "[force/length]",
     MaterialRange::NotNegative, OF_DMT, false, &MaterialNumbers::surface_energy},
    {"twisting_stiffness", "k_twist", "twisting stiffness", "[force length]",
     MaterialRange::NotNegative, OF_ALL_LAWS, true, &MaterialNumbers::twisting_stiffness, 3},
    {"twisting_friction", "twisting_friction", "twisting friction", "[length]",
     MaterialRange::NotNegative, OF_ALL_LAWS, true, &MaterialNumbers::twisting_friction, 3},
    {"rolling_viscosity", "gamma_r", "rolling viscosity", "[force time/length]",
     MaterialRange::NotNegative, OF_ALL_LAWS, true, &MaterialNumbers::rolling_viscosity, 0, true},
    {"twisting_viscosity", "gamma_twist", "twisting viscosity", "[force length time]",
     MaterialRange::NotNegative, OF_ALL_LAWS, true, &MaterialNumbers::twisting_viscosity, 3, true},
    {"objective_damping", "damping_objective", "choice of objective local damping", "[-]",
     MaterialRange::Switch, OF_GRAINS, true, &MaterialNumbers::objective_damping, 3, true},
    {"twisting_marshall", "twisting_marshall", "choice of twisting resistance by friction", "[-]",
     MaterialRange::Switch, OF_ALL_LAWS, true, &MaterialNumbers::twisting_marshall, 3, true},
    {"adhesion_reach", "adhesion_reach", "reach of the adhesion", "[length]",
     MaterialRange::NotNegative, OF_DMT, true, &MaterialNumbers::adhesion_reach, 0, true},
    // clang-format on
};

/// Returns the power of a quantity in a unit of the table. For example, the power of length in
/// "[force time/length]" is -1.
constexpr int power_in(const char *unit, const char *quantity)
{
  int sign = 1, power = 0;
  for (const char *position = unit; *position != 0; ++position) {
    if (*position == '/') sign = -1;
    const char *behind = position, *letter = quantity;
    for (; *letter != 0 && *behind == *letter; ++letter) ++behind;
    if (*letter == 0) power += sign * (*behind == '^' ? behind[1] - '0' : 1);
  }
  return power;
}

constexpr const char *unit_of(MaterialMember member)
{
  for (const MaterialParameter &parameter : MATERIAL_PARAMETERS)
    if (parameter.member == member) return parameter.unit;
  return "";
}

/// Powers of the units of force and length in a parameter.
template <MaterialMember member> struct UnitOf {
  static_assert(unit_of(member)[0] != 0, "it is not in the table of parameters");
  static constexpr int force = power_in(unit_of(member), "force"),
                       length = power_in(unit_of(member), "length");
};

}    // namespace rve
