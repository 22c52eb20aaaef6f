// SPDX-License-Identifier: GPL-2.0-only
// A fuzzing target in the form of libFuzzer, with which it can also be linked, and its functions
// for fuzz_main.cpp.

#pragma once

#include "mutator.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// Treats an input and returns 0. A failure ends the program.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size);

namespace fuzz {

/// Returns initial inputs in addition to those of the folders.
std::vector<std::string> seeds();

/// Returns a changed input.
std::string changed(const std::string &input, Mutator &mutator);

/// Ends the program with a reason.
[[noreturn]] void fail(const std::string &reason);

}    // namespace fuzz
