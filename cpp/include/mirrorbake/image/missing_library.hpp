#pragma once

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {

/// OpenImageIO, which is loaded when a file needs it, is not there. The message says what to install. Python:
/// ImportError.
class MissingLibrary : public FileError {
 public:
  using FileError::FileError;
};

}  // namespace mirrorbake
