// SPDX-License-Identifier: GPL-2.0-only
// Choice of a kernel variant from the table in kernel_variants.h.

#pragma once

#include "rve/engine/contact_model.h"
#include "rve/engine/kernel_variants.h"

namespace rve {

/// Features that a call may need of its kernel variant, besides the contact model of its RVEs.
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
/// `prepared` of the first suitable line of the table. This variant has all features of the others
/// with its memory layout. Throws InputError if there is none.
KernelVariant memory_variant(const ContactModel &contacts);

/// Returns the last variant of a law for disks or spheres; with rolling resistance if the law
/// supports it.
KernelVariant richest_variant(ContactLaw law, int dimension = 2);

/// Returns the leanest variant with that memory layout and the features that a call needs. Throws
/// InputError if the contact law lacks one.
KernelVariant choose_variant(KernelVariant memory, const CallNeeds &needs);

}    // namespace rve
