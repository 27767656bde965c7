# Compiler settings shared by every target: standard, warnings, sanitizers, ccache.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

find_program(PHOTOSPHERE_CCACHE ccache)
if(PHOTOSPHERE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${PHOTOSPHERE_CCACHE}")
endif()

# Settings of our own sources. They reach consumers only where they must (the language standard).
add_library(photosphere_settings INTERFACE)
target_compile_features(photosphere_settings INTERFACE cxx_std_20)
target_compile_options(photosphere_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual
  # Equal bits need one rounding per operation: no fused multiply-add, no reassociation.
  -ffp-contract=off
  # Square roots set errno otherwise, which keeps them from being one instruction.
  -fno-math-errno)
if(PHOTOSPHERE_WERROR)
  target_compile_options(photosphere_settings INTERFACE -Werror)
endif()
if(PHOTOSPHERE_NATIVE)
  target_compile_options(photosphere_settings INTERFACE -march=native)
endif()
if(PHOTOSPHERE_SANITIZE)
  add_compile_options(-fsanitize=${PHOTOSPHERE_SANITIZE} -fno-omit-frame-pointer)
  # A sanitizer calls dlopen in the program's stead, and only the older kind of run path serves both.
  add_link_options(-fsanitize=${PHOTOSPHERE_SANITIZE} LINKER:--disable-new-dtags)
  if(PHOTOSPHERE_SANITIZE MATCHES "fuzzer")
    add_compile_definitions(FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION)
  endif()
  if(PHOTOSPHERE_SANITIZE MATCHES "undefined")
    add_compile_options(-fno-sanitize-recover=undefined)
  endif()
endif()
if(PHOTOSPHERE_TIDY)
  find_program(PHOTOSPHERE_CLANG_TIDY NAMES clang-tidy clang-tidy-14 REQUIRED)
endif()
