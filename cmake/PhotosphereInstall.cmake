# Install and export: the tool, the library, its headers, and a package that find_package finds.
include(CMakePackageConfigHelpers)
set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/photosphere")

install(TARGETS photosphere EXPORT photosphereTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
get_property(loaded GLOBAL PROPERTY PHOTOSPHERE_LOADED)
install(TARGETS ${loaded} LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}/photosphere")
install(TARGETS photosphere_app RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/photosphere"
  DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/data/color" "${PROJECT_SOURCE_DIR}/data/hard"
  "${PROJECT_SOURCE_DIR}/data/reference" "${PROJECT_SOURCE_DIR}/data/studies"
  DESTINATION "${CMAKE_INSTALL_DATADIR}/photosphere")
install(EXPORT photosphereTargets NAMESPACE photosphere:: DESTINATION "${package_dir}")

configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/photosphereConfig.cmake.in"
  "${PROJECT_BINARY_DIR}/photosphereConfig.cmake" INSTALL_DESTINATION "${package_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/photosphereConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES
  "${PROJECT_BINARY_DIR}/photosphereConfig.cmake"
  "${PROJECT_BINARY_DIR}/photosphereConfigVersion.cmake"
  "${PROJECT_SOURCE_DIR}/cmake/PhotosphereDependencies.cmake"
  DESTINATION "${package_dir}")
