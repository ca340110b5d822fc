# What --version of each program says: the project's version, the commit, the build type, the camera library.
find_package(PkgConfig REQUIRED)
pkg_check_modules(ARAVIS REQUIRED IMPORTED_TARGET GLOBAL aravis-0.8>=0.8.20)
execute_process(COMMAND git -C ${PROJECT_SOURCE_DIR} describe --always --dirty
                OUTPUT_VARIABLE ZEROPOSE_COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)

# zeropose_version(FILE): gives it ZEROPOSE_VERSION, ZEROPOSE_COMMIT, ZEROPOSE_BUILD_TYPE and ZEROPOSE_ARAVIS_VERSION.
function(zeropose_version file)
  set_property(SOURCE ${file} APPEND PROPERTY COMPILE_DEFINITIONS
    ZEROPOSE_VERSION="${PROJECT_VERSION}" ZEROPOSE_COMMIT="${ZEROPOSE_COMMIT}"
    ZEROPOSE_BUILD_TYPE="${CMAKE_BUILD_TYPE}" ZEROPOSE_ARAVIS_VERSION="${ARAVIS_VERSION}")
endfunction()
