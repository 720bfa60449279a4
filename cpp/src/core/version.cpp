#include "mirrorbake/core/version.hpp"

namespace mirrorbake {

const char* version() { return MIRRORBAKE_VERSION; }

}  // namespace mirrorbake
