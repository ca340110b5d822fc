# One static library per room. Its link list is the architecture: nothing else may be included.
find_package(Threads REQUIRED)

add_library(zeropose_flags INTERFACE)
target_include_directories(zeropose_flags INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(zeropose_flags INTERFACE -Wall -Wextra -Wconversion -Wshadow -Wnon-virtual-dtor -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
  target_compile_options(zeropose_flags INTERFACE -fpch-preprocess)  # for ccache
endif()
if(ZEROPOSE_SANITIZE)
  set(instrument -fsanitize=${ZEROPOSE_SANITIZE})
  if(ZEROPOSE_SANITIZE STREQUAL thread)
    # The pure rooms have no threads, and with it they would miss every deadline.
    set(instrument $<IF:$<BOOL:$<TARGET_PROPERTY:ZEROPOSE_PURE>>,-O2,-fsanitize=thread>)
  endif()
  target_compile_options(zeropose_flags INTERFACE ${instrument} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(zeropose_flags INTERFACE -fsanitize=${ZEROPOSE_SANITIZE})
  if(ZEROPOSE_SANITIZE MATCHES undefined)
    # These make files that use Eigen or JSON four times slower to compile; AddressSanitizer finds what they would.
    target_compile_options(zeropose_flags INTERFACE -fno-sanitize=null,alignment,object-size,vptr)
  endif()
endif()

# ThreadSanitizer leaves the pure rooms as they are: then they need not be compiled again.
set(ZEROPOSE_PURE_ROOMS_OF "" CACHE PATH "A finished build whose libraries of the pure rooms are used (preset tsan only)")

# zeropose_room(NAME SOURCES ... LINK ...): the library zeropose_NAME. PRECOMPILED: the group of headers it begins with,
# pure for a room without threads and I/O.
function(zeropose_room name)
  cmake_parse_arguments(ROOM "" "PRECOMPILED" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  if(ZEROPOSE_PURE_ROOMS_OF AND ROOM_PRECOMPILED STREQUAL pure)
    add_library(zeropose_${name} STATIC IMPORTED GLOBAL)
    set_target_properties(zeropose_${name} PROPERTIES
      IMPORTED_LOCATION ${ZEROPOSE_PURE_ROOMS_OF}/${name}/libzeropose_${name}.a)
    target_link_libraries(zeropose_${name} INTERFACE zeropose_flags ${ROOM_LINK} ${ROOM_PRIVATE_LINK})
    return()
  endif()
  add_library(zeropose_${name} STATIC ${ROOM_SOURCES})
  target_link_libraries(zeropose_${name} PUBLIC zeropose_flags ${ROOM_LINK} PRIVATE ${ROOM_PRIVATE_LINK})
  if(ROOM_PRECOMPILED)
    zeropose_precompile(zeropose_${name} ${ROOM_PRECOMPILED})
  endif()
  if(ROOM_PRECOMPILED STREQUAL pure)
    set_property(TARGET zeropose_${name} PROPERTY ZEROPOSE_PURE ON)
  endif()
endfunction()
