#pragma once

namespace mirrorbake {

/// Version of the library, "MAJOR.MINOR.PATCH".
const char* version();

}  // namespace mirrorbake
