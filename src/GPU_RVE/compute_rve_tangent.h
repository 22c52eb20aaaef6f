// SPDX-License-Identifier: GPL-2.0-only
/* -*- c++ -*- ----------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// Compute rve/tangent measures the tangent stiffness of the RVEs of fix rve by small probing
// strains and gives it as a per-atom array.

#ifdef COMPUTE_CLASS
// clang-format off
ComputeStyle(rve/tangent,ComputeRveTangent);
// clang-format on
#else

#ifndef LMP_COMPUTE_RVE_TANGENT_H
#define LMP_COMPUTE_RVE_TANGENT_H

#include "compute.h"

#include <memory>

namespace LAMMPS_NS {

class ComputeRveTangent : public Compute {
 public:
  ComputeRveTangent(class LAMMPS *, int, char **);
  ~ComputeRveTangent() override;

  void init() override;
  void compute_peratom() override;
  double memory_usage() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl;
};

}    // namespace LAMMPS_NS

#endif
#endif
