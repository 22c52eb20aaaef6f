// SPDX-License-Identifier: GPL-2.0-only
#include "cuda/cuda_choice.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace rve {

namespace {

  std::string capability_text(int capability)
  {
    return std::to_string(capability / 10) + "." + std::to_string(capability % 10);
  }

  std::string version_text(int version)
  {
    return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
  }

  /// Returns a text such as "8.0 (PTX), 9.0 (binary, PTX)".
  std::string text_of(const std::vector<CudaArchitecture> &architectures)
  {
    std::string text;
    for (const CudaArchitecture &architecture : architectures) {
      if (!text.empty()) text += ", ";
      text += capability_text(architecture.number) + " (" + (architecture.binary ? "binary" : "") +
          (architecture.binary && architecture.ptx ? ", " : "") + (architecture.ptx ? "PTX" : "") +
          (architecture.only ? ", for this one only" : "") + ")";
    }
    return text.empty() ? "none" : text;
  }

  std::string name_of(const GpuProperties &gpu)
  {
    return gpu.name + " (compute capability " + capability_text(gpu.capability) + ")";
  }

  std::string how_to_build(const GpuProperties &gpu)
  {
    return "build it with cmake -D CMAKE_CUDA_ARCHITECTURES=" + std::to_string(gpu.capability);
  }

}    // namespace

std::vector<CudaArchitecture> cuda_architectures(const std::string &list)
{
  std::vector<CudaArchitecture> architectures;
  std::istringstream words(list);
  for (std::string word; std::getline(words, word, ':');) {
    char *end = nullptr;
    CudaArchitecture architecture;
    architecture.number = static_cast<int>(std::strtol(word.c_str(), &end, 10));
    if (end == word.c_str()) continue;
    std::string suffix = end;
    if (!suffix.empty() && (suffix[0] == 'a' || suffix[0] == 'f')) {
      architecture.only = suffix[0] == 'a';
      architecture.family = suffix[0] == 'f';
      suffix.erase(0, 1);
    }
    architecture.binary = suffix != "-virtual";
    architecture.ptx = suffix != "-real";
    architectures.push_back(architecture);
  }
  return architectures;
}

GpuCode code_for(int capability, const std::vector<CudaArchitecture> &architectures)
{
  GpuCode best = GpuCode::None;
  for (const CudaArchitecture &has : architectures) {
    if (has.number > capability || (has.only && has.number != capability)) continue;
    const bool same_generation = has.number / 10 == capability / 10;
    if (has.binary && same_generation) best = GpuCode::Binary;
    if (has.ptx && (same_generation || !has.family)) best = std::max(best, GpuCode::Ptx);
  }
  return best;
}

std::string gpu_obstacle(const GpuProperties &gpu,
                         const std::vector<CudaArchitecture> &architectures)
{
  if (gpu.capability < kOldestCapability)
    return "the " + name_of(gpu) + " is too old: GPU_RVE needs compute capability " +
        capability_text(kOldestCapability) + " (A100, GeForce RTX 30) or newer";
  if (code_for(gpu.capability, architectures) != GpuCode::None) return "";
  return "this program has no code for the " + name_of(gpu) + ", only for " +
      text_of(architectures) + "; " + how_to_build(gpu);
}

std::string loading_obstacle(const GpuProperties &gpu, GpuCode code, const std::string &words)
{
  std::string text = "the " + name_of(gpu) + " cannot be used (" + words + ")";
  if (code == GpuCode::Ptx)
    text +=
        "; this program has only PTX for it, which the driver must compile: if it is too old for "
        "that, update it, or " +
        how_to_build(gpu);
  return text;
}

std::string driver_obstacle(DriverError driver_error, int driver_version, int runtime_version,
                            const char *visible, const std::string &words)
{
  switch (driver_error) {
    case DriverError::NoDriver:
      return "no NVIDIA driver was found (a container must be started with the GPUs of its host)";
    case DriverError::OldDriver:
      return "the NVIDIA driver is too old: it supports CUDA " + version_text(driver_version) +
          ", but this program needs CUDA " + version_text(runtime_version) +
          "; update the driver, or build with CUDA " + version_text(driver_version) + " or older";
    case DriverError::NoDevice:
      return visible ? "no CUDA device is visible with CUDA_VISIBLE_DEVICES='" +
              std::string(visible) + "'; unset it to use all devices"
                     : std::string("there is no CUDA device");
    default:
      return "no CUDA device can be used (" + words + ")";
  }
}

CudaChoice choose_gpu(const std::vector<std::string> &obstacles, int local_rank)
{
  std::vector<int> usable;
  CudaChoice choice;
  for (std::size_t k = 0; k < obstacles.size(); ++k) {
    if (obstacles[k].empty()) {
      usable.push_back(static_cast<int>(k));
    } else if (choice.obstacle.find(obstacles[k]) == std::string::npos) {
      if (!choice.obstacle.empty()) choice.obstacle += "; ";
      choice.obstacle += obstacles[k];
    }
  }
  if (usable.empty()) {
    if (obstacles.empty()) choice.obstacle = "there is no CUDA device";
    return choice;
  }
  return {usable[local_rank % usable.size()], ""};
}

}    // namespace rve
