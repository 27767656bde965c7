# Fails when a file of module M includes a header of a module that M's row does not name, or when a
# third-party library leaves its room (ARCHITECTURE.md). Variables: ROOT, TABLE.
file(STRINGS "${TABLE}" rows)
set(violations "")
set(rooms
  "OpenEXR/:image" "Imath:image" "OpenImageIO/:image" "OpenColorIO/:image" "toml:scene" "CLI/:cli"
  "tbb/:core;volume" "Random123/:core" "openvdb/:volume" "spdlog/:core" "nanoflann:volume;estimators")
foreach(row IN LISTS rows)
  string(REGEX MATCH "^([a-z]+): ?(.*)$" _ "${row}")
  set(module "${CMAKE_MATCH_1}")
  string(REPLACE " " ";" allowed "${CMAKE_MATCH_2}")
  list(APPEND allowed "${module}")
  file(GLOB_RECURSE files "${ROOT}/include/photosphere/${module}/*.h" "${ROOT}/src/${module}/*.h"
    "${ROOT}/src/${module}/*.cpp")
  foreach(file IN LISTS files)
    file(STRINGS "${file}" includes REGEX "^#include")
    foreach(include IN LISTS includes)
      if(include MATCHES "\"photosphere/([a-z]+)/")
        if(NOT CMAKE_MATCH_1 IN_LIST allowed)
          list(APPEND violations "${file}: ${include} (module '${module}' may use: ${allowed})")
        endif()
      endif()
      foreach(room IN LISTS rooms)
        string(REPLACE ":" ";" parts "${room}")
        list(POP_FRONT parts prefix)
        # openvdb/version.h is the forward-declaration header and may appear in public headers.
        if(include MATCHES "^#include [<\"]${prefix}" AND NOT include MATCHES "openvdb/version.h"
           AND NOT module IN_LIST parts)
          list(APPEND violations "${file}: ${include} (only in: ${parts})")
        endif()
      endforeach()
    endforeach()
  endforeach()
endforeach()
if(violations)
  string(JOIN "\n  " text ${violations})
  message(FATAL_ERROR "includes that the module table does not allow:\n  ${text}")
endif()
message(STATUS "layers hold")
