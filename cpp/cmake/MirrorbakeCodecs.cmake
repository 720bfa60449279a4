# Finds the libraries of compressed images and meshes: libwebp and libzstd, which have no CMake package where they are built
# without CMake, Draco and meshoptimizer. Used by our build and by the installed package. Targets: WebP::webp, Zstd::zstd.
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

find_library(ZSTD_LIBRARY zstd)
find_path(ZSTD_INCLUDE_DIR zstd.h)
if(ZSTD_LIBRARY AND ZSTD_INCLUDE_DIR)
  set(zstd_FOUND TRUE)
  if(NOT TARGET Zstd::zstd)
    add_library(Zstd::zstd UNKNOWN IMPORTED GLOBAL)
    set_target_properties(Zstd::zstd PROPERTIES
      IMPORTED_LOCATION "${ZSTD_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${ZSTD_INCLUDE_DIR}")
  endif()
endif()

find_package(draco CONFIG QUIET)
find_package(meshoptimizer CONFIG QUIET)
mark_as_advanced(WEBP_LIBRARY WEBP_INCLUDE_DIR ZSTD_LIBRARY ZSTD_INCLUDE_DIR)
