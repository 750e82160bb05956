# The target fingerpad::fingerpad, from beside this package.
find_package(fingerpad REQUIRED PATHS "${fingerpad_vendor_DIR}/../../.." NO_DEFAULT_PATH)
