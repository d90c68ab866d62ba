#pragma once

#include <string>

namespace vcharge {

/// Of this program's file and the suite's libraries that it has loaded: another build of the code has another
/// one.
std::string programHash();
/// Of a whole file: tells two recordings of one name apart. InputError when it cannot be read.
std::string fileHash(const std::string& path);

}  // namespace vcharge
