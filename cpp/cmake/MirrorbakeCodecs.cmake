# Finds the libraries of compressed images and meshes: libwebp, which has no CMake package where it is built without CMake,
# Draco and meshoptimizer. Used by our build and by the installed package. Target: WebP::webp.
find_library(WEBP_LIBRARY webp)
find_path(WEBP_INCLUDE_DIR webp/decode.h)
if(WEBP_LIBRARY AND WEBP_INCLUDE_DIR)
  set(webp_FOUND TRUE)
  if(NOT TARGET WebP::webp)
    add_library(WebP::webp UNKNOWN IMPORTED GLOBAL)
    set_target_properties(WebP::webp PROPERTIES
      IMPORTED_LOCATION "${WEBP_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${WEBP_INCLUDE_DIR}")
  endif()
endif()

find_package(draco CONFIG QUIET)
find_package(meshoptimizer CONFIG QUIET)
mark_as_advanced(WEBP_LIBRARY WEBP_INCLUDE_DIR)
