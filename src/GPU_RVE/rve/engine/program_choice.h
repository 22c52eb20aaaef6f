// SPDX-License-Identifier: GPL-2.0-only
// Which line of the table of programs serves.

#pragma once

#include "rve/engine/contact_model.h"
#include "rve/engine/programs.h"

namespace rve {

/// What a call may need of its program beside the contact model of its RVEs.
struct CallNeeds {
  bool friction = false;
  bool dashpots = false;
  bool rescaling = false;    ///< of springs whose contacts grow or shrink (has_rescaling of a law)
  bool servo = false;
  bool books = false;    ///< all of them (Books::All)
};

/// What a program has.
struct ProgramFeatures {
  ContactModel contacts;
  CallNeeds has;
  Program memory;    ///< the program that says what an RVE is in memory: `prepared` of the table
};

ProgramFeatures features_of(Program program);

/// The program whose memory RVEs of these contacts have: `prepared` of the first one of the table that serves them. It has all that
/// the others with that memory have. Throws InputError if none serves them.
Program memory_program(const ContactModel &contacts);

/// The last program of the table of this law for disks or for spheres: with rolling resistance, if the law may have it.
Program richest_program(ContactLaw law, int dimension = 2);

/// The leanest program with that memory that has what a call needs. Throws InputError if the contact law has it not.
Program choose_program(Program memory, const CallNeeds &needs);

}    // namespace rve
