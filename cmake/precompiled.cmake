# Headers that most files of a group begin with, parsed once for all of them: half of a build's time. A file still
# includes what it uses; with -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON it has nothing else.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)

set(standard_headers <algorithm> <array> <atomic> <chrono> <cmath> <filesystem> <fstream> <functional> <map> <memory>
    <mutex> <numbers> <optional> <random> <set> <span> <sstream> <string> <thread> <variant> <vector>)

# zeropose_precompiled(GROUP LINK ... HEADERS ... OPTIONS ...): what zeropose_precompile(TARGET GROUP) then uses. The
# compiler takes it only for files of the same flags, and its optimisation is theirs.
function(zeropose_precompiled group)
  cmake_parse_arguments(GROUP "" "" "LINK;HEADERS;OPTIONS" ${ARGN})
  add_library(zeropose_precompiled_${group} OBJECT ${PROJECT_SOURCE_DIR}/cmake/empty.cpp)
  target_link_libraries(zeropose_precompiled_${group} PRIVATE zeropose_flags ${GROUP_LINK})
  target_compile_options(zeropose_precompiled_${group} PRIVATE ${GROUP_OPTIONS})
  target_precompile_headers(zeropose_precompiled_${group} PRIVATE ${standard_headers} ${GROUP_HEADERS})
endfunction()

# Inside a precompiled std::string g++ 12 shows warnings that it holds back elsewhere, about overruns that are none.
function(zeropose_precompile target group)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
  endif()
  target_precompile_headers(${target} REUSE_FROM zeropose_precompiled_${group})
endfunction()

zeropose_precompiled(pure LINK Eigen3::Eigen HEADERS <Eigen/Geometry>)
zeropose_precompiled(json LINK Eigen3::Eigen nlohmann_json::nlohmann_json HEADERS <Eigen/Geometry> <nlohmann/json.hpp>)
