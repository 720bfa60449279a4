# Defines `mirrorbake_embree` from Embree 4 or, failing that, 3 (what Debian 12 and Ubuntu 22.04 ship). Installed
# with the package too: a consumer has to find the same library.
find_package(embree 4 CONFIG QUIET)
if(NOT embree_FOUND)
  find_package(embree 3.13 CONFIG QUIET)
endif()
if(embree_FOUND AND NOT TARGET mirrorbake_embree)
  add_library(mirrorbake_embree INTERFACE IMPORTED GLOBAL)
  # Debian's Embree 3 sets variables only; other builds export a target.
  if(TARGET embree)
    target_link_libraries(mirrorbake_embree INTERFACE embree)
  else()
    target_include_directories(mirrorbake_embree SYSTEM INTERFACE ${EMBREE_INCLUDE_DIRS})
    target_link_libraries(mirrorbake_embree INTERFACE ${EMBREE_LIBRARIES})
  endif()
  target_compile_definitions(mirrorbake_embree INTERFACE MIRRORBAKE_EMBREE_MAJOR=${EMBREE_VERSION_MAJOR})
endif()
