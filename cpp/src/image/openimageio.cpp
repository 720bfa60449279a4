#include "openimageio.hpp"

#include <dlfcn.h>

#include "mirrorbake/image/missing_library.hpp"

namespace mirrorbake::image_files {
namespace {

const OpenImageIo& load() {
  // Found by the run path of the program or extension module that this code is part of. Never unloaded: its
  // thread pools and caches last as long as the process.
  void* const library = dlopen(MIRRORBAKE_OPENIMAGEIO_LIBRARY, RTLD_NOW | RTLD_LOCAL);
  void* const entry = library == nullptr ? nullptr : dlsym(library, MIRRORBAKE_OPENIMAGEIO_ENTRY);
  if (entry == nullptr) {
    const char* const reason = dlerror();
    throw MissingLibrary(MIRRORBAKE_OPENIMAGEIO_LIBRARY,
                         std::string("is needed for TIFF, PNG and JPEG files and for writing HDR, and cannot "
                                     "be loaded: ") +
                             (reason == nullptr ? "unknown reason" : one_line(reason)) +
                             "; install OpenImageIO (Debian, Ubuntu: apt-get install libopenimageio-dev)");
  }
  return *reinterpret_cast<const OpenImageIo* (*)()>(entry)();
}

}  // namespace

const OpenImageIo& openimageio() {
  static const OpenImageIo& loaded = load();
  return loaded;
}

}  // namespace mirrorbake::image_files
