// SPDX-License-Identifier: GPL-2.0-only
// A target of fuzzing in the form of libFuzzer, with which it can be linked as well, and what fuzz_main.cpp wants to know of it.

#pragma once

#include "mutator.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// Treats an input; whatever it is, this returns 0. A failure ends the program.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size);

namespace fuzz {

/// Inputs to begin with, beside those of the folders.
std::vector<std::string> seeds();

/// A changed input.
std::string changed(const std::string &input, Mutator &mutator);

/// Ends the program with a reason.
[[noreturn]] void fail(const std::string &reason);

}    // namespace fuzz
