# Debian packages by `cpack -B build/packages` in the build folder: programs, library, Python module, documentation.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME selvedge)
set(CPACK_PACKAGE_VENDOR Selvedge)
set(CPACK_PACKAGE_CONTACT "The Selvedge authors <selvedge@example.org>")
set(CPACK_PACKAGE_HOMEPAGE_URL "https://example.org/selvedge")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
                                                WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_RUNTIME_OUTPUT_DIRECTORY})

# deb_package(COMPONENT NAME SECTION "SUMMARY" "TEXT")
function(deb_package component name section summary text)
  string(TOUPPER ${component} key)
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_COMPONENT_${key}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
  # Debian wants its copyright and changelog in each package.
  set(folder ${CMAKE_INSTALL_DATADIR}/doc/${name})
  install(FILES ${PROJECT_SOURCE_DIR}/apps/packages/copyright DESTINATION ${folder} COMPONENT ${component})
  install(FILES ${CMAKE_BINARY_DIR}/changelog.gz DESTINATION ${folder} COMPONENT ${component})
endfunction()

string(TIMESTAMP today "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE ${CMAKE_BINARY_DIR}/changelog "selvedge (${PROJECT_VERSION}) stable; urgency=medium\n\n  * See CHANGELOG.md in \
selvedge-doc.\n\n -- ${CPACK_PACKAGE_CONTACT}  ${today}\n")
execute_process(COMMAND gzip -9nf ${CMAKE_BINARY_DIR}/changelog)

deb_package(programs selvedge graphics "fabric appearance for glTF"
  "Makes fabric files from stitches, bakes and fits them, dresses glTF garments\nin them, and shows the garments.")
deb_package(library libselvedge-dev libdevel "reader of fabric files for C++"
  "One shared library and one header: reads fabric files, evaluates them and\ngives access to every layer.")
deb_package(documentation selvedge-doc doc "manual and specification of Selvedge"
  "How to make fabrics and dress garments in them, and the format of fabric\nfiles and of the glTF extension.")
if(TARGET selvedge_python)
  deb_package(python python3-selvedge python "fabric appearance for glTF, in Python"
    "Fabric files as arrays, their evaluation, and every verb of the program.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.11), python3 (<< 3.12), python3-numpy, selvedge (= ${PROJECT_VERSION})")
endif()
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_ARCHITECTURE all)
install(DIRECTORY docs spec DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/selvedge-doc COMPONENT documentation
  PATTERN gallery EXCLUDE PATTERN conformance EXCLUDE PATTERN Doxyfile EXCLUDE)
install(FILES README.md CHANGELOG.md SECURITY.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/selvedge-doc
  COMPONENT documentation)
# What CPack would write for every shared object, also for private ones.
set(soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
file(WRITE ${CMAKE_BINARY_DIR}/debian/shlibs "libselvedge ${soversion} libselvedge-dev (>= ${PROJECT_VERSION})\n")
file(WRITE ${CMAKE_BINARY_DIR}/debian/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${CMAKE_BINARY_DIR}/debian/shlibs ${CMAKE_BINARY_DIR}/debian/triggers)
include(CPack)
