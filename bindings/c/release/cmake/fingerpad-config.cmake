# Makes the target fingerpad::fingerpad of the library for the processor that is compiled for.
#
# FINGERPAD_TARGET names the library's folder below lib/fingerpad; without it the processor decides
# (CMAKE_SYSTEM_PROCESSOR). Cortex-M4, M7 and M33 are taken with hardware floats; others go by FINGERPAD_TARGET.
get_filename_component(_fingerpad_root "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

set(_fingerpad_target "${FINGERPAD_TARGET}")
if(NOT _fingerpad_target)
  string(TOLOWER "${CMAKE_SYSTEM_PROCESSOR}" _fingerpad_processor)
  if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
    set(_fingerpad_target "${_fingerpad_processor}-unknown-linux-gnu")
  elseif(_fingerpad_processor MATCHES "^(cortex-m0|cortex-m0plus|cortex-m0\\+|cortex-m3|armv6-?m|armv7-?m)$")
    set(_fingerpad_target "thumbv6m-none-eabi")
  elseif(_fingerpad_processor MATCHES "^(cortex-m4|cortex-m4f|cortex-m7|cortex-m33|armv7e-?m)$")
    set(_fingerpad_target "thumbv7em-none-eabihf")
  elseif(_fingerpad_processor MATCHES "^(riscv|riscv32|rv32imac)$")
    set(_fingerpad_target "riscv32imac-unknown-none-elf")
  endif()
endif()

set(_fingerpad_library "${_fingerpad_root}/lib/fingerpad/${_fingerpad_target}/libfingerpad.a")
if(NOT _fingerpad_target OR NOT EXISTS "${_fingerpad_library}")
  file(GLOB _fingerpad_there RELATIVE "${_fingerpad_root}/lib/fingerpad" "${_fingerpad_root}/lib/fingerpad/*")
  list(JOIN _fingerpad_there ", " _fingerpad_there)
  set(fingerpad_FOUND FALSE)
  set(fingerpad_NOT_FOUND_MESSAGE
    "no library for '${_fingerpad_target}' (CMAKE_SYSTEM_PROCESSOR is '${CMAKE_SYSTEM_PROCESSOR}'). There are: ${_fingerpad_there}. Choose one with -DFINGERPAD_TARGET=...")
  return()
endif()

if(NOT TARGET fingerpad::fingerpad)
  add_library(fingerpad::fingerpad STATIC IMPORTED GLOBAL)
  set_target_properties(fingerpad::fingerpad PROPERTIES
    IMPORTED_LOCATION "${_fingerpad_library}"
    INTERFACE_INCLUDE_DIRECTORIES "${_fingerpad_root}/include")
endif()

# The shipped model file.
set(fingerpad_MODEL "${_fingerpad_root}/share/fingerpad/fingertip.fpm")
set(fingerpad_FOUND TRUE)
