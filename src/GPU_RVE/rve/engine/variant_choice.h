// SPDX-License-Identifier: GPL-2.0-only
// Choice of a kernel variant from the table in kernel_variants.h.

#pragma once

#include "rve/engine/contact_model.h"
#include "rve/engine/kernel_variants.h"

namespace rve {

/// Features of a kernel variant that calls can need, in addition to the contact model of the RVEs.
struct CallNeeds {
  bool friction = false;
  bool dashpots = false;
  bool rescaling = false;    ///< springs change with the contact radius (Law::has_rescaling)
  bool servo = false;
  bool has_bookkeeping = false;    ///< all bookkeeping of energy and stress (Bookkept::All)
};

/// Features of a kernel variant.
struct VariantFeatures {
  ContactModel contacts;
  CallNeeds has;
  KernelVariant memory;    ///< variant that defines the memory layout: `prepared` of the table
};

VariantFeatures features_of(KernelVariant variant);

/// Returns the variant that defines the memory layout of RVEs with these contacts: the column
/// `prepared` of the first suitable line of the table. This variant has all features of the other
/// variants with its memory layout. Throws InputError if no line is suitable.
KernelVariant memory_variant(const ContactModel &contacts);

/// Returns the last variant of a contact law for disks or spheres. It has rolling resistance if the
/// law supports it.
KernelVariant richest_variant(ContactLaw law, int dimension = 2);

/// Returns the leanest variant with that memory layout and the features that a call needs. Throws
/// InputError if the contact law does not support one of the features.
KernelVariant choose_variant(KernelVariant memory, const CallNeeds &needs);

}    // namespace rve
