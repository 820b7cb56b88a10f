# WebAssembly modules, which no C++ code needs: without Node.js or clang for wasm32 they are left out.
find_program(NODE node)
find_program(WASM_CLANG clang++-19)

# wasm_module(NAME HEADERS ... FLAGS ... BATCHES "FOLDER SOURCE..." ...): NAME.wasm of sources that are compiled together, as
# what takes time is the headers; "-Oz FOLDER ...": as small ones. A source "*" stands for all of its folder, but for those that are named with "-".
# HEADERS: of templates alone, in /usr/include; a whole one has another C library.
# CATCHES: exceptions are caught (format/web/exceptions.cpp), and there are paths; else the first one ends the instance.
function(wasm_module name)
  cmake_parse_arguments(ARG CATCHES "" "HEADERS;FLAGS;BATCHES" ${ARGN})
  set(headers ${CMAKE_CURRENT_BINARY_DIR}/include)
  file(MAKE_DIRECTORY ${headers})
  foreach(path ${ARG_HEADERS})
    get_filename_component(folder ${path} NAME)
    file(CREATE_LINK /usr/include/${path} ${headers}/${folder} SYMBOLIC)
  endforeach()
  # One lane width, four.
  set(flags --target=wasm32-wasi -std=c++20 -O2 -msimd128 -fno-math-errno
    -fno-trapping-math -ffp-contract=off -ffunction-sections -fdata-sections -DIMATH_HALF_NO_LOOKUP_TABLE
    -include ${PROJECT_SOURCE_DIR}/format/base/stand_ins.h -isystem ${headers} -I${PROJECT_SOURCE_DIR}
    -Wall -Wextra -Werror -Wno-psabi ${ARG_FLAGS})
  set(libraries)
  if(ARG_CATCHES)
    set(libraries -lwasi-emulated-process-clocks -lc-printscan-long-double)
    list(APPEND flags -fwasm-exceptions -D_WASI_EMULATED_PROCESS_CLOCKS -isystem ${PROJECT_SOURCE_DIR}/format/web/include)
  else()
    list(APPEND flags -fexceptions -fignore-exceptions)
  endif()
  set(objects)
  foreach(batch ${ARG_BATCHES})
    separate_arguments(batch UNIX_COMMAND "${batch}")
    set(small)
    if(batch MATCHES "^-Oz")
      list(POP_FRONT batch small)
    endif()
    list(POP_FRONT batch folder)
    set(paths)
    foreach(source ${batch})
      string(REGEX REPLACE "^-" "" name_of_source ${source})
      file(GLOB found CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/${name_of_source}.cpp)
      if(source MATCHES "^-")
        list(REMOVE_ITEM paths ${found})
      else()
        list(APPEND paths ${found})
      endif()
    endforeach()
    list(TRANSFORM paths REPLACE "(.+)" "#include \"\\1\"\n")
    list(JOIN paths "" text)
    list(LENGTH objects number)
    set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}-${number}.cpp)
    set(object ${CMAKE_CURRENT_BINARY_DIR}/${name}-${number}.o)
    file(CONFIGURE OUTPUT ${source} CONTENT "${text}" @ONLY)
    add_custom_command(OUTPUT ${object} DEPENDS ${source} VERBATIM DEPFILE ${object}.d
      COMMAND ${CMAKE_CXX_COMPILER_LAUNCHER} ${WASM_CLANG} ${flags} ${small} -MD -MF ${object}.d -c ${source} -o ${object})
    list(APPEND objects ${object})
  endforeach()
  set(module ${CMAKE_CURRENT_BINARY_DIR}/${name}.wasm)
  add_custom_command(OUTPUT ${module} DEPENDS ${objects}
    COMMAND ${WASM_CLANG} --target=wasm32-wasi -mexec-model=reactor -fuse-ld=lld -O2 ${objects} -o ${module}
      -Wl,--gc-sections -Wl,--strip-all -Wl,-z,stack-size=1048576 ${libraries})
endfunction()
