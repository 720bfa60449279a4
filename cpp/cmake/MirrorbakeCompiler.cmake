# Language level, warnings, sanitizers and coverage, gathered on one interface target that every
# target of this project (and no consumer) links privately.

set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

find_program(MIRRORBAKE_CCACHE ccache)
if(PROJECT_IS_TOP_LEVEL AND MIRRORBAKE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${MIRRORBAKE_CCACHE}")
endif()

add_library(mirrorbake_build_flags INTERFACE)
target_compile_options(mirrorbake_build_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor
  # Contraction would make results depend on the compiler and on inlining: the same input has to give
  # the same bits everywhere. Math functions never set errno here, which lets sqrt be vectorised.
  -ffp-contract=off -fno-math-errno)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 sees an overlap in every `"literal" + std::string` at -O2 and above (GCC bug 105651).
  target_compile_options(mirrorbake_build_flags INTERFACE -Wno-restrict)
endif()
if(MIRRORBAKE_WARNINGS_AS_ERRORS)
  target_compile_options(mirrorbake_build_flags INTERFACE -Werror)
endif()
if(MIRRORBAKE_BUILD_FUZZERS)
  # libFuzzer is guided by what its inputs reach in the library.
  target_compile_options(mirrorbake_build_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(MIRRORBAKE_SANITIZERS)
  target_compile_options(mirrorbake_build_flags INTERFACE
    -fsanitize=${MIRRORBAKE_SANITIZERS} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(mirrorbake_build_flags INTERFACE -fsanitize=${MIRRORBAKE_SANITIZERS})
  if(NOT APPLE)
    # The sanitizers' dlopen searches the DT_RUNPATH of their own library instead of the caller's; a DT_RPATH of the program
    # holds for all.
    target_link_options(mirrorbake_build_flags INTERFACE -Wl,--disable-new-dtags)
  endif()
endif()
if(MIRRORBAKE_COVERAGE)
  target_compile_options(mirrorbake_build_flags INTERFACE --coverage -fprofile-update=atomic)
  target_link_options(mirrorbake_build_flags INTERFACE --coverage)
endif()
