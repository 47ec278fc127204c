# The CMake package: find_package(holdfast) gives the target holdfast::holdfast, the static library with its header.
#
# The library is chosen by HOLDFAST_TARGET, the name of a folder under lib/; without it, by what is built for.
get_filename_component(holdfast_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

if(NOT HOLDFAST_TARGET)
  if(NOT CMAKE_CROSSCOMPILING)
    set(HOLDFAST_TARGET host)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(cortex-m4|cortex-m7|armv7e-m|thumbv7em)")
    set(HOLDFAST_TARGET thumbv7em-none-eabihf)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(cortex-m0|cortex-m0plus|armv6-m|thumbv6m)")
    set(HOLDFAST_TARGET thumbv6m-none-eabi)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(riscv|riscv32)")
    set(HOLDFAST_TARGET riscv32imc-unknown-none-elf)
  endif()
endif()

set(holdfast_library "${holdfast_prefix}/lib/${HOLDFAST_TARGET}/libholdfast.a")
if(NOT HOLDFAST_TARGET OR NOT EXISTS "${holdfast_library}")
  set(holdfast_FOUND FALSE)
  set(holdfast_NOT_FOUND_MESSAGE
      "no library for '${CMAKE_SYSTEM_PROCESSOR}': set HOLDFAST_TARGET to one of the folders in ${holdfast_prefix}/lib")
  return()
endif()

if(NOT TARGET holdfast::holdfast)
  add_library(holdfast::holdfast STATIC IMPORTED)
  set_target_properties(holdfast::holdfast PROPERTIES
    IMPORTED_LOCATION "${holdfast_library}"
    INTERFACE_INCLUDE_DIRECTORIES "${holdfast_prefix}/include")
  if(HOLDFAST_TARGET STREQUAL "host")
    set_target_properties(holdfast::holdfast PROPERTIES INTERFACE_LINK_LIBRARIES "pthread;dl;m")
  endif()
endif()
