# SPDX-License-Identifier: GPL-2.0-only
# Sets `python`: a Python 3 with numpy, empty if there is none. Debian's is in /usr/bin, also where
# another python3 is first on the PATH.
set(python "")
foreach(candidate /usr/bin/python3 python3)
  execute_process(COMMAND ${candidate} -c "import numpy" RESULT_VARIABLE missing OUTPUT_QUIET
    ERROR_QUIET)
  if(missing STREQUAL "0")
    set(python ${candidate})
    break()
  endif()
endforeach()
