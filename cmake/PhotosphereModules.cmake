# photosphere_module(NAME name [USES module...] [LIBRARIES target...])
#
# Declares one module from every .cpp of the calling folder (searched recursively): an object library
# whose objects become part of the library `photosphere`. USES is the row of the module table: the
# modules that this one may include. It is recorded for the layer test, which reads the includes.
# With PHOTOSPHERE_UNITY six sources are compiled as one, as most of the time goes into headers that they
# share: names differ from file to file, also those that no other file sees.
define_property(GLOBAL PROPERTY PHOTOSPHERE_MODULES BRIEF_DOCS "Module names, lowest first")
define_property(GLOBAL PROPERTY PHOTOSPHERE_MODULE_TABLE BRIEF_DOCS "module: used modules")
define_property(GLOBAL PROPERTY PHOTOSPHERE_LOADED BRIEF_DOCS "Libraries loaded when needed")
set(PHOTOSPHERE_LOADED_DIR "${PROJECT_BINARY_DIR}/lib/photosphere")
list(APPEND CMAKE_BUILD_RPATH "${PHOTOSPHERE_LOADED_DIR}")

function(photosphere_module)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "NAME" "USES;LIBRARIES;SOURCES")
  set(target photosphere_${arg_NAME})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  list(FILTER sources EXCLUDE REGEX "/loaded/")
  if(NOT sources AND NOT arg_SOURCES)
    return()
  endif()
  add_library(${target} OBJECT ${sources} ${arg_SOURCES})
  target_include_directories(${target}
    PUBLIC "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>"
    PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}")
  set_target_properties(${target} PROPERTIES
    UNITY_BUILD ${PHOTOSPHERE_UNITY} UNITY_BUILD_BATCH_SIZE 6)
  target_link_libraries(${target} PRIVATE photosphere_settings)
  target_link_libraries(${target} PUBLIC glm::glm fmt::fmt ${arg_LIBRARIES})
  if(PHOTOSPHERE_TIDY)
    set_target_properties(${target} PROPERTIES CXX_CLANG_TIDY "${PHOTOSPHERE_CLANG_TIDY}")
  endif()
  set_property(GLOBAL APPEND PROPERTY PHOTOSPHERE_MODULES ${arg_NAME})
  string(JOIN " " uses ${arg_USES})
  set_property(GLOBAL APPEND PROPERTY PHOTOSPHERE_MODULE_TABLE "${arg_NAME}: ${uses}")
endfunction()

# photosphere_loaded(NAME name LIBRARIES target...)
#
# Declares photosphere_<name>.so from loaded/<name>.cpp of the calling folder, which takes no part in the
# module: it links libraries that most runs do not need, and is loaded by name when it is. Programs of
# this build find it by CMAKE_BUILD_RPATH, the installed tool by its INSTALL_RPATH, programs that link the
# library by the link options that it passes on (src/CMakeLists.txt).
function(photosphere_loaded)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "NAME" "LIBRARIES")
  set(target photosphere_${arg_NAME})
  add_library(${target} MODULE "loaded/${arg_NAME}.cpp")
  set_target_properties(${target} PROPERTIES PREFIX ""
    LIBRARY_OUTPUT_DIRECTORY "${PHOTOSPHERE_LOADED_DIR}")
  target_include_directories(${target} PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}")
  target_link_libraries(${target} PRIVATE photosphere_settings ${arg_LIBRARIES})
  set_property(GLOBAL APPEND PROPERTY PHOTOSPHERE_LOADED ${target})
endfunction()

# photosphere_plugins(MODULE module TYPE type FUNCTION function HEADER header [ALONE] PLUGINS stem...)
#
# Generates the constant table of a plug-in folder. Each stem is a source `<stem>.cpp` that defines
# `const <type> photosphere::<module>::plugins::<stem>`; the table is what `<function>()` returns,
# a std::span<const <type>* const>. A self-registering static would be dropped by the linker from a
# static library; this table cannot be. ALONE: the sources share names, and each is compiled by itself.
function(photosphere_plugins)
  cmake_parse_arguments(PARSE_ARGV 0 arg "ALONE" "MODULE;TYPE;FUNCTION;HEADER" "PLUGINS")
  set(declarations "")
  set(entries "")
  foreach(stem IN LISTS arg_PLUGINS)
    string(APPEND declarations "extern const ${arg_TYPE} ${stem};\n")
    string(APPEND entries "    &plugins::${stem},\n")
  endforeach()
  if(arg_ALONE)
    list(TRANSFORM arg_PLUGINS REPLACE "(.+)" "${CMAKE_CURRENT_SOURCE_DIR}/\\1.cpp" OUTPUT_VARIABLE names)
    file(GLOB_RECURSE sources ${names})  # of any folder below
    set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
  set(PLUGIN_MODULE "${arg_MODULE}")
  set(PLUGIN_TYPE "${arg_TYPE}")
  set(PLUGIN_FUNCTION "${arg_FUNCTION}")
  set(PLUGIN_HEADER "${arg_HEADER}")
  set(PLUGIN_DECLARATIONS "${declarations}")
  set(PLUGIN_ENTRIES "${entries}")
  set(output "${PROJECT_BINARY_DIR}/generated/${arg_MODULE}_${arg_FUNCTION}.cpp")
  configure_file("${PROJECT_SOURCE_DIR}/cmake/plugin_table.cpp.in" "${output}" @ONLY)
  target_sources(photosphere_${arg_MODULE} PRIVATE "${output}")
endfunction()
