// SPDX-License-Identifier: GPL-2.0-only
// Which CUDA card serves, and what is said where none can. Knows nothing of the CUDA runtime, so that any machine can test it.

#pragma once

#include <string>
#include <vector>

namespace rve {

/// The oldest compute capability that the kernels can be compiled for: 8.0, whose warps add integers by one instruction.
constexpr int kOldestCapability = 80;

struct CudaCard {
  std::string name;
  int capability = 0;    ///< 10 major + minor
};

/// What a program has for an architecture.
struct CudaArchitecture {
  int number = 0;    ///< 10 major + minor
  bool binary = false;
  bool ptx = false;       ///< text that the driver compiles at first use
  bool only = false;      ///< for this architecture alone (a suffix `a`)
  bool family = false;    ///< for those of its generation alone (a suffix `f`)
};

/// From CMake's words, separated by colons: "80-virtual:90". Others than numbers are left out.
std::vector<CudaArchitecture> cuda_architectures(const std::string &list);

enum class CardCode { None, Ptx, Binary };

/// What a card runs of a program that has these.
CardCode code_for(int capability, const std::vector<CudaArchitecture> &architectures);

/// Why the card cannot run the program, with a remedy; empty when it can.
std::string card_obstacle(const CudaCard &card, const std::vector<CudaArchitecture> &architectures);

/// Of a card that has code by these lists, but could not load it; `words` are CUDA's. By text: perhaps its driver is too old for that.
std::string loading_obstacle(const CudaCard &card, CardCode code, const std::string &words);

/// What CUDA answers when it is asked for devices.
enum class DriverTrouble { NoDriver, OldDriver, NoDevice, Other };

/// The same in words, with a remedy. Versions are as of CUDA, 1000 major + 10 minor; `visible` is CUDA_VISIBLE_DEVICES of the environment,
/// or null.
std::string driver_obstacle(DriverTrouble trouble, int driver_version, int runtime_version,
                            const char *visible, const std::string &words);

struct CudaChoice {
  int number = -1;         ///< of the device, as CUDA counts
  std::string obstacle;    ///< why there is none
};

/// Of the cards with these obstacles: ranks of a machine take those without one in turn.
CudaChoice choose_card(const std::vector<std::string> &obstacles, int local_rank);

}    // namespace rve
