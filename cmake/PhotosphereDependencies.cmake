# Finds every library that a program linking photosphere needs. Used by the build and, installed beside
# photosphereConfig.cmake, by consumers of the package: both need the same repairs.

find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)
find_package(TBB REQUIRED)
find_package(fmt REQUIRED)
find_package(glm REQUIRED)

# Debian keeps FindOpenVDB.cmake off the search path. It calls find_package(Boost) for iostreams.
find_path(PHOTOSPHERE_FIND_OPENVDB_DIR FindOpenVDB.cmake
  PATHS /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB /usr/lib/cmake/OpenVDB
        /usr/local/lib/cmake/OpenVDB
  DOC "Folder of FindOpenVDB.cmake")
if(PHOTOSPHERE_FIND_OPENVDB_DIR)
  list(APPEND CMAKE_MODULE_PATH "${PHOTOSPHERE_FIND_OPENVDB_DIR}")
endif()
find_package(OpenVDB 10.0 REQUIRED COMPONENTS openvdb)

find_package(OpenEXR 3.1 REQUIRED)

# Debian puts OpenColorIOConfig.cmake straight into /usr/share/cmake, where find_package does not look.
find_package(OpenColorIO 2.1 REQUIRED PATHS /usr/share/cmake)

# Two of Debian's targets name include folders that are not there, at which CMake stops: OpenImageIO
# that of OpenCV, which its package does not require, and OpenColorIO the folder /include.
function(photosphere_drop_absent_includes target)
  get_target_property(includes ${target} INTERFACE_INCLUDE_DIRECTORIES)
  set(present "")
  foreach(folder IN LISTS includes)
    if(IS_DIRECTORY "${folder}" OR folder MATCHES "^[$]<")
      list(APPEND present "${folder}")
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${present}")
endfunction()
photosphere_drop_absent_includes(OpenColorIO::OpenColorIO)
