# mirrorbake_add_module(NAME SOURCES ... [DEPENDS module...] [PRIVATE target...])
#
# One static library `mirrorbake::NAME` per folder cpp/src/NAME. DEPENDS names the other modules it may
# use, and is the only place where the direction of dependencies is decided; PRIVATE names third-party
# targets that stay behind the module.
function(mirrorbake_add_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;DEPENDS;PRIVATE")
  set(target mirrorbake_${name})
  add_library(${target} STATIC ${arg_SOURCES})
  add_library(mirrorbake::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/cpp/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(${target} PUBLIC glm::glm PRIVATE $<BUILD_INTERFACE:mirrorbake_build_flags>)
  foreach(module IN LISTS arg_DEPENDS)
    target_link_libraries(${target} PUBLIC mirrorbake::${module})
  endforeach()
  target_link_libraries(${target} PRIVATE ${arg_PRIVATE})
  set_property(GLOBAL APPEND PROPERTY MIRRORBAKE_MODULES ${target})
endfunction()

# mirrorbake_add_isa_sources(MODULE SOURCES ...)
#
# Compiles the sources once per instruction set into the module, with MIRRORBAKE_ISA set to the name of the
# level (core/isa.hpp): they keep everything they define in a namespace of that name, include no header that
# defines inline functions outside it (the linker would be free to keep the AVX-512 copy for everyone), and
# the module picks one at run time. -O3 vectorises; -fno-trapping-math only allows both sides of a
# condition to be evaluated; neither changes a value.
function(mirrorbake_add_isa_sources module)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES")
  set(levels baseline)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND levels sse42 avx2 avx512)
    target_compile_definitions(mirrorbake_${module} PRIVATE MIRRORBAKE_HAS_X86_LEVELS=1)
  endif()
  set(flags_sse42 -msse4.2)
  set(flags_avx2 -mavx2 -mtune=haswell)
  set(flags_avx512 -mavx512f -mavx512bw -mavx512dq -mavx512vl -mprefer-vector-width=512 -mtune=skylake-avx512)
  foreach(level IN LISTS levels)
    set(object mirrorbake_${module}_${level})
    add_library(${object} OBJECT ${arg_SOURCES})
    target_compile_features(${object} PRIVATE cxx_std_20)
    target_include_directories(${object} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/cpp/include)
    target_compile_definitions(${object} PRIVATE MIRRORBAKE_ISA=${level})
    target_link_libraries(${object} PRIVATE mirrorbake_build_flags)
    target_compile_options(${object} PRIVATE ${flags_${level}})
    if(NOT MIRRORBAKE_SANITIZERS AND NOT MIRRORBAKE_COVERAGE)
      # GCC would follow each side of a selection as a path of its own through the rest of a formula and blend at
      # every step; a third faster without.
      target_compile_options(${object} PRIVATE -O3 -fno-trapping-math
        $<$<CXX_COMPILER_ID:GNU>:-fno-thread-jumps -fno-ssa-phiopt>)
    endif()
    target_sources(mirrorbake_${module} PRIVATE $<TARGET_OBJECTS:${object}>)
  endforeach()
endfunction()

# mirrorbake_add_test(MODULE SOURCES ... [DEPENDS module...]): one GoogleTest executable test_MODULE.
function(mirrorbake_add_test module)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;DEPENDS;PRIVATE")
  set(target test_${module})
  add_executable(${target} ${arg_SOURCES})
  target_link_libraries(${target} PRIVATE mirrorbake_build_flags mirrorbake::${module} GTest::gtest_main GTest::gmock
                                          ${arg_PRIVATE})
  foreach(dependency IN LISTS arg_DEPENDS)
    target_link_libraries(${target} PRIVATE mirrorbake::${dependency})
  endforeach()
  gtest_discover_tests(${target} TEST_PREFIX "${module}." DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT 600)
endfunction()

# mirrorbake_add_tool(NAME SOURCES ... DEPENDS module...): one command-line program NAME. In a wheel it lies where pip puts
# programs, and finds the library that it loads in the package.
function(mirrorbake_add_tool name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;DEPENDS;PRIVATE")
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE mirrorbake_build_flags CLI11::CLI11 nlohmann_json::nlohmann_json ${arg_PRIVATE})
  foreach(module IN LISTS arg_DEPENDS)
    target_link_libraries(${name} PRIVATE mirrorbake::${module})
  endforeach()
  target_compile_definitions(${name} PRIVATE MIRRORBAKE_VERSION="${PROJECT_VERSION}")
  file(RELATIVE_PATH library_dir ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR}/mirrorbake)
  set(run_path "$<IF:$<PLATFORM_ID:Darwin>,@loader_path,$ORIGIN>/")
  set(library_dirs ${library_dir})
  # An editable package has no programs: pip would not renew them. script/bootstrap links to those of the build tree.
  if(DEFINED SKBUILD_SCRIPTS_DIR AND NOT SKBUILD_STATE STREQUAL "editable")
    # From bin/: of an environment, where libraries have a folder of their own, of Debian's Python, and of pip's --target.
    set(python python${Python_VERSION_MAJOR}.${Python_VERSION_MINOR})
    set(library_dirs ../lib/${python}/site-packages/mirrorbake ../lib64/${python}/site-packages/mirrorbake
                     ../lib/${python}/dist-packages/mirrorbake ../mirrorbake)
    install(TARGETS ${name} RUNTIME DESTINATION ${SKBUILD_SCRIPTS_DIR} COMPONENT python)
  endif()
  list(TRANSFORM library_dirs PREPEND "${run_path}")
  set_target_properties(${name} PROPERTIES INSTALL_RPATH "${library_dirs}")
  install(TARGETS ${name} COMPONENT tools)
endfunction()
