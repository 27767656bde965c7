# Installs the build into a scratch folder, builds test/consumer against it and runs both programs.
# Variables: SOURCE, BUILD, WORK, COMPILER, BUILD_TYPE.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT result EQUAL 0)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\nended with ${result}:\n${text}")
  endif()
  set(output "${text}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE "${WORK}")
set(prefix "${WORK}/prefix")
run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${prefix}")
run("${CMAKE_COMMAND}" -S "${SOURCE}/test/consumer" -B "${WORK}/build" -G Ninja
  -D "CMAKE_PREFIX_PATH=${prefix}" -D "CMAKE_CXX_COMPILER=${COMPILER}"
  -D "CMAKE_BUILD_TYPE=${BUILD_TYPE}" -D CMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
run("${CMAKE_COMMAND}" --build "${WORK}/build")
run("${WORK}/build/consumer")
message(STATUS "consumer: ${output}")

# Nothing that was installed may point back into the source or the build.
file(GLOB_RECURSE package "${prefix}/*.cmake")
foreach(file IN LISTS package)
  file(READ "${file}" text)
  foreach(folder IN ITEMS "${SOURCE}/" "${BUILD}/")
    string(REPLACE "${prefix}" "" text "${text}")
    string(FIND "${text}" "${folder}" found)
    if(NOT found EQUAL -1)
      message(FATAL_ERROR "${file} names ${folder}")
    endif()
  endforeach()
endforeach()

# The installed tool takes the colour config installed beside it: spoil that one, and it is noticed.
set(config "${prefix}/share/photosphere/color/config.ocio")
set(render "${prefix}/bin/photosphere" render "${SOURCE}/data/caches/column_0020.vdb"
  -o "${WORK}/a.exr" --preview "${WORK}/a.png" --res 32x18 -s estimator.type=single -q)
run(${render})

# What it loads for pictures is the library beside it; without that it says so before the work.
file(RENAME "${prefix}/lib/photosphere" "${prefix}/lib/hidden")
execute_process(COMMAND ${render} RESULT_VARIABLE result ERROR_VARIABLE text OUTPUT_QUIET)
if(NOT result EQUAL 1 OR NOT text MATCHES "photosphere_openimageio.so.*install photosphere whole")
  message(FATAL_ERROR "a library that is not there: exit ${result}\n${text}")
endif()
file(RENAME "${prefix}/lib/hidden" "${prefix}/lib/photosphere")

file(WRITE "${config}" "not a config\n")
execute_process(COMMAND ${render} RESULT_VARIABLE result ERROR_VARIABLE text OUTPUT_QUIET)
if(result EQUAL 0 OR NOT text MATCHES "prefix/share/photosphere/color/config.ocio")
  message(FATAL_ERROR "the installed tool does not read ${config}: exit ${result}\n${text}")
endif()
message(STATUS "the install serves a consumer and its own tool")
