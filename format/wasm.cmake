# WebAssembly modules, which no C++ code needs: without Node.js or clang for wasm32 they are left out.
find_program(NODE node)
find_program(WASM_CLANG clang++-19)

# wasm_module(NAME HEADERS ... FLAGS ... BATCHES "FOLDER SOURCE..." ...): NAME.wasm of sources that are compiled together, as
# what takes time is the headers. HEADERS: of templates alone, in /usr/include; a whole one has another C library.
function(wasm_module name)
  cmake_parse_arguments(ARG "" "" "HEADERS;FLAGS;BATCHES" ${ARGN})
  set(headers ${CMAKE_CURRENT_BINARY_DIR}/include)
  file(MAKE_DIRECTORY ${headers})
  foreach(path ${ARG_HEADERS})
    get_filename_component(folder ${path} NAME)
    file(CREATE_LINK /usr/include/${path} ${headers}/${folder} SYMBOLIC)
  endforeach()
  # One lane width, four.
  set(flags --target=wasm32-wasi -std=c++20 -O2 -msimd128 -fexceptions -fignore-exceptions -fno-math-errno
    -fno-trapping-math -ffp-contract=off -ffunction-sections -fdata-sections -DIMATH_HALF_NO_LOOKUP_TABLE
    -include ${PROJECT_SOURCE_DIR}/format/base/stand_ins.h -isystem ${headers} -I${PROJECT_SOURCE_DIR}
    -Wall -Wextra -Werror -Wno-psabi ${ARG_FLAGS})
  set(objects)
  foreach(batch ${ARG_BATCHES})
    separate_arguments(batch UNIX_COMMAND "${batch}")
    list(POP_FRONT batch folder)
    list(TRANSFORM batch REPLACE "(.+)" "#include \"${folder}/\\1.cpp\"\n")
    list(JOIN batch "" text)
    string(REPLACE / _ object ${folder})
    set(source ${CMAKE_CURRENT_BINARY_DIR}/${object}.cpp)
    set(object ${CMAKE_CURRENT_BINARY_DIR}/${object}.o)
    file(CONFIGURE OUTPUT ${source} CONTENT "${text}" @ONLY)
    add_custom_command(OUTPUT ${object} DEPENDS ${source} VERBATIM DEPFILE ${object}.d
      COMMAND ${WASM_CLANG} ${flags} -MD -MF ${object}.d -c ${source} -o ${object})
    list(APPEND objects ${object})
  endforeach()
  set(module ${CMAKE_CURRENT_BINARY_DIR}/${name}.wasm)
  add_custom_command(OUTPUT ${module} DEPENDS ${objects}
    COMMAND ${WASM_CLANG} --target=wasm32-wasi -mexec-model=reactor -fuse-ld=lld -O2 ${objects} -o ${module}
      -Wl,--gc-sections -Wl,--strip-all -Wl,-z,stack-size=1048576)
endfunction()
