# One static library per room. Its link list is the architecture: nothing else may be included.
find_package(Threads REQUIRED)

add_library(zeropose_flags INTERFACE)
target_include_directories(zeropose_flags INTERFACE ${PROJECT_SOURCE_DIR})
if(NOT ZEROPOSE_SANITIZE OR ZEROPOSE_FUZZ)  # to warn of the same files once more costs a twelfth of the second build
  target_compile_options(zeropose_flags INTERFACE -Wall -Wextra -Wconversion -Wshadow -Wnon-virtual-dtor)
endif()
target_compile_options(zeropose_flags INTERFACE -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
  target_compile_options(zeropose_flags INTERFACE -fpch-preprocess)  # for ccache
endif()
if(ZEROPOSE_SANITIZE)
  target_compile_options(zeropose_flags INTERFACE -fsanitize=${ZEROPOSE_SANITIZE} -fno-sanitize-recover=all
                         -fno-omit-frame-pointer)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(zeropose_flags INTERFACE --param=ggc-min-heapsize=400000)  # kB before it collects garbage
  endif()
  target_link_options(zeropose_flags INTERFACE -fsanitize=${ZEROPOSE_SANITIZE})
  if(ZEROPOSE_SANITIZE MATCHES address AND NOT ZEROPOSE_FUZZ)
    # Or Eigen would lay out its memory otherwise than in the release build's test objects.
    target_compile_definitions(zeropose_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  endif()
  if(ZEROPOSE_SANITIZE MATCHES undefined)
    # These make files that use Eigen or JSON four times slower to compile; AddressSanitizer finds what they would.
    target_compile_options(zeropose_flags INTERFACE -fno-sanitize=null,alignment,object-size,vptr)
  endif()
endif()

# Rooms without threads have nothing for ThreadSanitizer, and with it they would miss every deadline: there they come
# from another build.
set(ZEROPOSE_ROOMS_WITHOUT_THREADS_OF "" CACHE PATH "The finished build of another preset that they come from")
# So does what only tests and demos use, with AddressSanitizer too.
set(ZEROPOSE_TEST_OBJECTS_OF "" CACHE PATH "The finished release build that the tests' code comes from")

# zeropose_room(NAME SOURCES ... LINK ...): the library zeropose_NAME. PRECOMPILED: the group of headers it begins with.
# OF_TESTS: what tests look at and measure with.
function(zeropose_room name)
  cmake_parse_arguments(ROOM "WITHOUT_THREADS;OF_TESTS" "PRECOMPILED" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  set(build "")
  if(ROOM_WITHOUT_THREADS)
    set(build ${ZEROPOSE_ROOMS_WITHOUT_THREADS_OF})
  elseif(ROOM_OF_TESTS)
    set(build ${ZEROPOSE_TEST_OBJECTS_OF})
  endif()
  if(build)
    file(RELATIVE_PATH folder ${CMAKE_BINARY_DIR} ${CMAKE_CURRENT_BINARY_DIR})
    add_library(zeropose_${name} STATIC IMPORTED GLOBAL)
    set_target_properties(zeropose_${name} PROPERTIES IMPORTED_LOCATION ${build}/${folder}/libzeropose_${name}.a)
    target_link_libraries(zeropose_${name} INTERFACE zeropose_flags ${ROOM_LINK} ${ROOM_PRIVATE_LINK})
    return()
  endif()
  add_library(zeropose_${name} STATIC ${ROOM_SOURCES})
  target_link_libraries(zeropose_${name} PUBLIC zeropose_flags ${ROOM_LINK} PRIVATE ${ROOM_PRIVATE_LINK})
  if(ROOM_PRECOMPILED)
    zeropose_precompile(zeropose_${name} ${ROOM_PRECOMPILED})
  endif()
endfunction()
