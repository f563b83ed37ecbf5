# find_package(sonarfix) with CMAKE_PREFIX_PATH or sonarfix_DIR at this package: the target sonarfix::sonarfix.
if(NOT TARGET sonarfix::sonarfix)
    add_subdirectory(${CMAKE_CURRENT_LIST_DIR}/.. ${CMAKE_BINARY_DIR}/sonarfix EXCLUDE_FROM_ALL)
endif()
