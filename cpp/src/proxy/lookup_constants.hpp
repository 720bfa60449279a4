#pragma once

#include "lookup_kernels.hpp"
#include "mirrorbake/proxy/proxy.hpp"

namespace mirrorbake {

/// A proxy as the loops over rays want it.
LookupConstants lookup_constants(const Proxy& proxy);

}  // namespace mirrorbake
