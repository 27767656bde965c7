#include "openimageio.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "photosphere/core/error.h"

namespace photosphere::image {
namespace {

constexpr const char* kFile = "photosphere_openimageio.so";

const OpenImageIo& load() {
  // Found by the run path of the program (photosphere_loaded in cmake). Never unloaded.
  void* library = dlopen(kFile, RTLD_LAZY | RTLD_LOCAL);
  const void* symbol = library ? dlsym(library, kOpenImageIoSymbol) : nullptr;
  if (!symbol)
    throw Error(ExitCode::unspecified,
                fmt::format("{}, which reads and writes pictures that are not EXR, cannot be "
                            "loaded: {}; install photosphere whole (lib/photosphere is part of "
                            "it), or add the file's folder to LD_LIBRARY_PATH",
                            kFile, dlerror()));
  return *static_cast<const OpenImageIo*>(symbol);
}

}  // namespace

const OpenImageIo& openImageIo() {
  static const OpenImageIo& functions = load();
  return functions;
}

}  // namespace photosphere::image
