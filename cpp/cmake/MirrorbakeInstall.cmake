# Installs the modules with their headers and an exported CMake package, so that a consumer writes
# find_package(mirrorbake) and links mirrorbake::mirrorbake.
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY MIRRORBAKE_MODULES)
install(TARGETS ${modules} mirrorbake EXPORT mirrorbakeTargets COMPONENT development)
install(DIRECTORY cpp/include/mirrorbake DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/mirrorbake)
install(EXPORT mirrorbakeTargets NAMESPACE mirrorbake:: DESTINATION ${package_dir} COMPONENT development)
configure_package_config_file(cpp/cmake/mirrorbakeConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/mirrorbakeConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/mirrorbakeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/mirrorbakeConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/mirrorbakeConfigVersion.cmake
              cpp/cmake/MirrorbakeCodecs.cmake cpp/cmake/MirrorbakeEmbree.cmake
        DESTINATION ${package_dir} COMPONENT development)
