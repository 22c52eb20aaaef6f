// SPDX-License-Identifier: GPL-2.0-only
#include "cuda/nvrtc.h"

#include <algorithm>
#include <dlfcn.h>
#include <link.h>
#include <memory>
#include <stdexcept>
#include <sys/stat.h>

namespace rve {

namespace {

  using Program = void *;
  constexpr int SUCCESS = 0, BUILTINS_MISSING = 7;    ///< values of nvrtcResult

  /// Flow callback of NVRTC.
  int is_cancelled(void *cancelled, void *)
  {
    return *static_cast<const std::atomic<bool> *>(cancelled) ? 1 : 0;
  }

  std::string file_of(void *library)
  {
    link_map *map = nullptr;
    return dlinfo(library, RTLD_DI_LINKMAP, &map) == 0 && map ? map->l_name : "";
  }

}    // namespace

/// Functions of the CUDA Toolkit's header nvrtc.h. They are redeclared, so a build needs neither
/// that header nor the library.
struct Nvrtc::Functions {
  void *library = nullptr;
  int (*version)(int *, int *) = nullptr;
  int (*num_architectures)(int *) = nullptr;
  int (*architectures)(int *) = nullptr;
  int (*create)(Program *, const char *, const char *, int, const char *const *,
                const char *const *) = nullptr;
  int (*destroy)(Program *) = nullptr;
  int (*add_name)(Program, const char *) = nullptr;
  int (*compile)(Program, int, const char *const *) = nullptr;
  int (*lowered_name)(Program, const char *, const char **) = nullptr;
  int (*log_size)(Program, std::size_t *) = nullptr;
  int (*log)(Program, char *) = nullptr;
  int (*cubin_size)(Program, std::size_t *) = nullptr;
  int (*cubin)(Program, char *) = nullptr;
  int (*ptx_size)(Program, std::size_t *) = nullptr;
  int (*ptx)(Program, char *) = nullptr;
  const char *(*words)(int) = nullptr;
  /// Sets a function that cancels the compilation if it returns 1; null before CUDA 12.8.
  int (*set_flow_callback)(Program, int (*)(void *, void *), void *) = nullptr;

  template <class Function> bool find(Function &function, const char *name)
  {
    function = reinterpret_cast<Function>(dlsym(library, name));
    return function != nullptr;
  }

  bool find_all()
  {
    find(set_flow_callback, "nvrtcSetFlowCallback");
    return find(version, "nvrtcVersion") && find(num_architectures, "nvrtcGetNumSupportedArchs") &&
        find(architectures, "nvrtcGetSupportedArchs") && find(create, "nvrtcCreateProgram") &&
        find(destroy, "nvrtcDestroyProgram") && find(add_name, "nvrtcAddNameExpression") &&
        find(compile, "nvrtcCompileProgram") && find(lowered_name, "nvrtcGetLoweredName") &&
        find(log_size, "nvrtcGetProgramLogSize") && find(log, "nvrtcGetProgramLog") &&
        find(cubin_size, "nvrtcGetCUBINSize") && find(cubin, "nvrtcGetCUBIN") &&
        find(ptx_size, "nvrtcGetPTXSize") && find(ptx, "nvrtcGetPTX") &&
        find(words, "nvrtcGetErrorString");
  }

  /// Throws std::runtime_error if `result` is an error. `what` names the call in the message.
  void check(int result, const char *what) const
  {
    if (result != SUCCESS)
      throw std::runtime_error(std::string("NVRTC, ") + what + ": " + words(result));
  }

  using Size = int (*)(Program, std::size_t *);
  using Text = int (*)(Program, char *);
  std::string text_of(Program program, Size size_of, Text get, const char *what) const
  {
    std::size_t size = 0;
    check(size_of(program, &size), what);
    std::string text(size, '\0');
    if (size > 0) check(get(program, &text[0]), what);
    return text;
  }
};

Nvrtc::Nvrtc(const std::vector<std::string> &libraries) : functions_(new Functions)
{
  std::string tried;
  for (const std::string &name : libraries) {
    functions_->library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (functions_->library && functions_->find_all()) break;
    // An old library lacks some of the functions.
    if (functions_->library) dlclose(functions_->library);
    functions_->library = nullptr;
    tried += (tried.empty() ? "" : ", ") + name;
  }
  if (!functions_->library) {
    obstacle_ = "the run-time compiler of the CUDA Toolkit, NVRTC, was not found (tried " + tried +
        "): install it, for example the package cuda-nvrtc-13-0 for CUDA 13.0, and add its folder "
        "to LD_LIBRARY_PATH; the Python package gpu_rve also finds nvidia-cuda-nvrtc of pip";
    return;
  }
  int minor = 0;
  functions_->version(&major_, &minor);
  identity_ = std::to_string(major_) + "." + std::to_string(minor);
  struct stat file;
  if (::stat(file_of(functions_->library).c_str(), &file) == 0)
    identity_ += " of " + std::to_string(file.st_size) + " bytes";
}

Nvrtc::~Nvrtc()
{
  if (functions_->library) dlclose(functions_->library);
  delete functions_;
}

const Nvrtc &Nvrtc::of_this_machine()
{
  // The name without a folder comes first, so that a library in LD_LIBRARY_PATH takes precedence.
  // The object is never destroyed, since the library has its own threads.
  static const Nvrtc &nvrtc = *new Nvrtc(
      {"libnvrtc.so." GPU_RVE_CUDA_MAJOR, GPU_RVE_CUDA_LIBRARIES "/libnvrtc.so", "libnvrtc.so"});
  return nvrtc;
}

std::string Nvrtc::target_for(int capability) const
{
  int count = 0;
  functions_->check(functions_->num_architectures(&count), "number of architectures");
  std::vector<int> known(count);
  functions_->check(functions_->architectures(known.data()), "architectures");
  if (std::find(known.begin(), known.end(), capability) != known.end())
    return "sm_" + std::to_string(capability);
  int newest = 0;
  for (const int number : known)
    if (number < capability) newest = std::max(newest, number);
  if (newest == 0)
    throw std::runtime_error("NVRTC " + identity_ + " does not support compute capability " +
                             std::to_string(capability / 10) + "." +
                             std::to_string(capability % 10));
  return "compute_" + std::to_string(newest);
}

DeviceCode Nvrtc::compile(const std::string &source, const std::vector<DeviceHeader> &headers,
                          const std::vector<std::string> &options, const std::string &kernel,
                          const std::atomic<bool> *cancelled) const
{
  const Functions &nvrtc = *functions_;
  std::vector<const char *> names, texts, words;
  for (const DeviceHeader &header : headers) {
    names.push_back(header.name);
    texts.push_back(header.text);
  }
  for (const std::string &option : options) words.push_back(option.c_str());
  Program program = nullptr;
  nvrtc.check(nvrtc.create(&program, source.c_str(), "kernel.cu", static_cast<int>(headers.size()),
                           texts.data(), names.data()),
              "creation of a program");
  const auto destroy = [&nvrtc](Program *owned) { nvrtc.destroy(owned); };
  const std::unique_ptr<Program, decltype(destroy)> owner(&program, destroy);
  nvrtc.check(nvrtc.add_name(program, kernel.c_str()), "name of a kernel");
  if (cancelled && nvrtc.set_flow_callback)
    nvrtc.check(
        nvrtc.set_flow_callback(program, is_cancelled, const_cast<std::atomic<bool> *>(cancelled)),
        "cancellation");

  const int result = nvrtc.compile(program, static_cast<int>(words.size()), words.data());
  if (result != SUCCESS) {
    constexpr std::size_t most = 4000;    // a log can have thousands of lines
    std::string log = nvrtc.text_of(program, nvrtc.log_size, nvrtc.log, "log");
    if (log.size() > most) log.resize(most);
    std::string message =
        "NVRTC " + identity_ + " cannot compile " + kernel + ": " + nvrtc.words(result);
    if (result == BUILTINS_MISSING)
      message += "; libnvrtc-builtins must be in the folder of libnvrtc and have the same version";
    throw std::runtime_error(message + "\n" + log.c_str());
  }
  DeviceCode compiled;
  const char *lowered = nullptr;
  nvrtc.check(nvrtc.lowered_name(program, kernel.c_str(), &lowered),
              "name of a kernel in its code");
  compiled.kernel = lowered;
  compiled.code = nvrtc.text_of(program, nvrtc.cubin_size, nvrtc.cubin, "code");
  compiled.text = nvrtc.text_of(program, nvrtc.ptx_size, nvrtc.ptx, "text");
  if (compiled.code.empty()) compiled.code = compiled.text;    // the options requested PTX only
  return compiled;
}

}    // namespace rve
