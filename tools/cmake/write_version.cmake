# Run at build time: writes OUTPUT from INPUT with HEDDLE_VERSION and, where SOURCE_DIR is the top of a git checkout, its revision.
# OUTPUT is touched only when its text changes.
set(HEDDLE_REVISION "")
find_program(GIT git)
if(GIT AND EXISTS ${SOURCE_DIR}/.git)
  execute_process(
    COMMAND ${GIT} --no-optional-locks describe --always --dirty=+dirty --exclude=*
    WORKING_DIRECTORY ${SOURCE_DIR}
    RESULT_VARIABLE failed
    OUTPUT_VARIABLE revision
    OUTPUT_STRIP_TRAILING_WHITESPACE
    ERROR_QUIET)
  if(NOT failed)
    set(HEDDLE_REVISION " (${revision})")
  endif()
endif()
configure_file(${INPUT} ${OUTPUT} @ONLY)
