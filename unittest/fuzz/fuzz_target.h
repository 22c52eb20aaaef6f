// SPDX-License-Identifier: GPL-2.0-only
// Interface of a fuzzing target. LLVMFuzzerTestOneInput() is the entry point that libFuzzer also
// calls. fuzz_main.cpp needs the other functions, seeds() and changed(), and defines fail().

#pragma once

#include "mutator.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// Processes one input and returns 0. A failure ends the program.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size);

namespace fuzz {

/// Returns initial inputs that are used in addition to the files in the folders.
std::vector<std::string> seeds();

/// Returns a changed input.
std::string changed(const std::string &input, Mutator &mutator);

/// Ends the program with a reason.
[[noreturn]] void fail(const std::string &reason);

}    // namespace fuzz
