# Finds what the enabled parts need, prints one table of what was found, and fails once, at the end,
# with everything that is missing and the packages that provide it.

# A project that adds mirrorbake as a subdirectory links these through our targets.
set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)

set(_mirrorbake_table "")
set(_mirrorbake_missing "")

function(_mirrorbake_report label found version minimum package purpose)
  if(${found})
    string(APPEND _mirrorbake_table "  found    ${label} ${version} (${purpose}, needs ${minimum})\n")
  else()
    string(APPEND _mirrorbake_table "  MISSING  ${label} (${purpose}, needs ${minimum})\n")
    list(APPEND _mirrorbake_missing ${package})
  endif()
  set(_mirrorbake_table "${_mirrorbake_table}" PARENT_SCOPE)
  set(_mirrorbake_missing "${_mirrorbake_missing}" PARENT_SCOPE)
endfunction()

find_package(glm CONFIG QUIET)
_mirrorbake_report(GLM glm_FOUND "${glm_VERSION}" 0.9.9 libglm-dev "vectors")

find_package(TBB 2020 CONFIG QUIET)
_mirrorbake_report(oneTBB TBB_FOUND "${TBB_VERSION}" 2020 libtbb-dev "threads")

# Not by find_package's version: Eigen 5 says that it does not stand in for 3.
find_package(Eigen3 CONFIG QUIET)
if(Eigen3_FOUND AND Eigen3_VERSION VERSION_LESS 3.4)
  set(Eigen3_FOUND FALSE)
endif()
_mirrorbake_report(Eigen Eigen3_FOUND "${Eigen3_VERSION}" 3.4 libeigen3-dev "small dense algebra")

find_package(ZLIB QUIET)
_mirrorbake_report(zlib ZLIB_FOUND "${ZLIB_VERSION_STRING}" 1.2 zlib1g-dev "image files")

# Debian's Imath, which OpenEXR and OpenImageIO pull in, reports its missing Python parts in spite of QUIET.
set(_mirrorbake_log_level "${CMAKE_MESSAGE_LOG_LEVEL}")
set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
find_package(OpenEXR 3.1 CONFIG QUIET)
find_package(OpenImageIO CONFIG QUIET)
set(CMAKE_MESSAGE_LOG_LEVEL "${_mirrorbake_log_level}")
_mirrorbake_report(OpenEXR OpenEXR_FOUND "${OpenEXR_VERSION}" 3.1 libopenexr-dev "EXR files")
if(OpenImageIO_FOUND AND OpenImageIO_VERSION VERSION_LESS 2.4)
  set(OpenImageIO_FOUND FALSE)
endif()
_mirrorbake_report(OpenImageIO OpenImageIO_FOUND "${OpenImageIO_VERSION}" 2.4 libopenimageio-dev "other image files")
if(OpenImageIO_FOUND)
  # Debian's package lists the include folder of OpenCV, which its headers do not use and which need not exist.
  get_target_property(_oiio_includes OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
  list(FILTER _oiio_includes EXCLUDE REGEX "opencv")
  set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${_oiio_includes}")
endif()

include(MirrorbakeCodecs)
_mirrorbake_report(libwebp webp_FOUND "" 1.2 libwebp-dev "WebP textures")
_mirrorbake_report(libzstd zstd_FOUND "" 1.5 libzstd-dev "KTX2 files")
_mirrorbake_report(Draco draco_FOUND "${draco_VERSION}" 1.5 libdraco-dev "compressed glTF meshes")
_mirrorbake_report(meshoptimizer meshoptimizer_FOUND "${meshoptimizer_VERSION}" 0.18 libmeshoptimizer-dev "compressed glTF meshes")

include(MirrorbakeEmbree)
_mirrorbake_report(Embree embree_FOUND "${EMBREE_VERSION}" "3.13 or 4" libembree-dev "ray tracing")

find_package(nlohmann_json CONFIG QUIET)
_mirrorbake_report("JSON for Modern C++" nlohmann_json_FOUND "${nlohmann_json_VERSION}" 3.11 nlohmann-json3-dev "glTF meshes, and what the tools print")

find_package(TinyGLTF CONFIG QUIET)
_mirrorbake_report(tinygltf TinyGLTF_FOUND "${TinyGLTF_VERSION}" 2.6 libtinygltf-dev "glTF meshes")

if(MIRRORBAKE_BUILD_TOOLS)
  find_package(CLI11 CONFIG QUIET)
  _mirrorbake_report(CLI11 CLI11_FOUND "${CLI11_VERSION}" 2.1 libcli11-dev "command lines of the tools")
endif()
if(MIRRORBAKE_BUILD_TESTS)
  find_package(GTest CONFIG QUIET)
  _mirrorbake_report(GoogleTest GTest_FOUND "${GTest_VERSION}" 1.12 "libgtest-dev libgmock-dev" "tests")
  include(GoogleTest)
endif()
if(MIRRORBAKE_BUILD_PYTHON)
  find_package(Python 3.11 COMPONENTS Interpreter Development.Module QUIET)
  if(Python_FOUND)
    execute_process(COMMAND "${Python_EXECUTABLE}" -m nanobind --cmake_dir
                    OUTPUT_STRIP_TRAILING_WHITESPACE OUTPUT_VARIABLE nanobind_ROOT ERROR_QUIET)
    find_package(nanobind CONFIG QUIET)
  endif()
  _mirrorbake_report(Python Python_FOUND "${Python_VERSION}" 3.11 python3-dev "bindings")
  _mirrorbake_report(nanobind nanobind_FOUND "${nanobind_VERSION}" 3.1 "nanobind, from PyPI" "bindings")
endif()

message(STATUS "mirrorbake dependencies:\n${_mirrorbake_table}")
if(_mirrorbake_missing)
  list(JOIN _mirrorbake_missing " " _mirrorbake_missing)
  message(FATAL_ERROR "mirrorbake: dependencies are missing (table above). On Debian or Ubuntu install: ${_mirrorbake_missing}")
endif()
